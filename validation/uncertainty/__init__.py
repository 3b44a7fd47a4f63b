"""How sure a figure is: the numerical error of a run, what is not known about its inputs, the
scatter of tests, and the verdict.
"""
