"""The paper's Continuous Model: penalty contact at the corners, one equation of motion for all modes."""

from cm.model import ContinuousModel
from cm.restitution import measured_restitution

__all__ = ["ContinuousModel", "measured_restitution"]
