"""The paper's Continuous Model: penalty contact at the corners, one equation of motion for all modes."""

from cm.model import ContinuousModel

__all__ = ["ContinuousModel"]
