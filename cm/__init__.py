"""The paper's Continuous Model: penalty contact at the corners, one equation of motion."""

from rockcheck.cm.model import ContinuousModel
from rockcheck.cm.restitution import measured_restitution

__all__ = ["ContinuousModel", "measured_restitution"]
