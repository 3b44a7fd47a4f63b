"""The paper's Continuous Model: penalty contact at the corners, one equation of motion."""

from rockcheck.cm.model import ContinuousModel

__all__ = ["ContinuousModel"]
