"""The paper's Continuous Model: penalty contact at the corners, one equation of motion."""

if __name__ == "cm":  # found in the folder of the sources: it would be a second copy
    raise ImportError("cm is a part of rockcheck: import rockcheck.cm")


from rockcheck.cm.model import ContinuousModel

__all__ = ["ContinuousModel"]
