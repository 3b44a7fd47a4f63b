"""Where the steps of the Continuous Model end, whatever the output times are."""

#: Steps end at multiples of this time, s: most records have their samples there.
GRID = 0.005
