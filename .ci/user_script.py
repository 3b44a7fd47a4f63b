"""What a user's type checker sees (`mypy --strict`): ten lines that are right but for the last,
whose remark is one too many where the types of `rockcheck` are not known."""

from rockcheck import Block, EventBasedModel, Floor, History, Ricker, Scene, compare

block = Block(half_width=0.2, half_height=1.0)
pulse = Ricker(amplitude=4.0, period=0.6)
scene = Scene(name="a", block=block, floor=Floor(friction=0.4), excitation=pulse, duration=2.0)
history: History = EventBasedModel(pivot="unilateral").simulate(scene)
outcome: str = history.outcome
table = compare(history, history).table
rows: int = len(history.frame)
wrong: int = history.outcome  # type: ignore[assignment]
