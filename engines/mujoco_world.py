"""A scene as MuJoCo holds it: the model's text, and its march."""

from typing import Any

from rockcheck.engines.contacts import Surface, surfaces_of
from rockcheck.engines.world import FloatArray, State, World
from rockcheck.scenes import ModelFailure, Scene
from rockcheck.scenes.errors import printable


class MuJoCoWorld(World):
    """A compiled model with its data, stepped by Euler's method."""

    def __init__(self, model_text: str) -> None:
        import mujoco

        self.mujoco: Any = mujoco
        # MuJoCo would print its warnings and keep a log of them in the working directory.
        self.warnings: list[str] = []
        self.former_handler = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(self.warnings.append)
        self.model: Any = mujoco.MjModel.from_xml_string(model_text)
        self.data: Any = mujoco.MjData(self.model)
        # Views of the data, which are dear to make anew in each step.
        self.qpos, self.qvel, self.qacc = self.data.qpos, self.data.qvel, self.data.qacc
        self.force = self.data.qfrc_applied[:2]
        self.dt = 0.0

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.qpos[:] = x, y, theta
        self.qvel[:] = vx, vy, w

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.force[:] = felt
        if dt != self.dt:
            self.model.opt.timestep = self.dt = dt
        self.mujoco.mj_step(self.model, self.data)

    def state(self) -> State:
        return (*self.qpos.tolist(), *self.qvel.tolist())

    def march(self, felt: FloatArray, dt: float) -> FloatArray:
        states = super().march(felt, dt)
        self.check()
        return states

    def check(self) -> None:
        """Raise `ModelFailure` if MuJoCo met a huge or non-finite state or acceleration."""
        if self.warnings:
            kinds = self.mujoco.mjtWarning
            bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
            if any(self.data.warning[kind].number for kind in bad):
                raise ModelFailure(f"MuJoCo: {printable(self.warnings[-1], 200)}")
            self.warnings.clear()

    def close(self) -> None:
        self.mujoco.set_mju_user_warning(self.former_handler)


def model_of(scene: Scene, planes: str, geoms: str, settings: str = "", raised: float = 0.0) -> str:
    """A MuJoCo model (XML) of planes and a planar body of unit mass, counterclockwise positive.

    The body moves in the plane x, z; its origin is `raised` m above the floor's.
    """
    inertia = scene.block.gyration_squared
    body = f"""
<body pos="0 0 {raised!r}">
  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>\
<joint type="hinge" axis="0 -1 0"/>
  <inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>
  {geoms}
</body>"""
    world = f"<worldbody>{planes}{body}</worldbody>"
    return f'<mujoco><option gravity="0 0 0"/>{settings}{world}</mujoco>'


def plane_of(surface: Surface, inset: float, attributes: str) -> str:
    """The floor, or a wall `inset` m behind its surface.

    The floor stays where it is and the block is raised instead: a plane nearer to the origin than
    1e-6 m MuJoCo takes to be in it.
    """
    place = "" if surface.surface == "floor" else f'pos="{surface.behind(inset)[0]!r} 0 0" '
    (nx, nz), name = surface.normal, surface.surface
    axis = f'zaxis="{nx!r} 0 {nz!r}"'
    return f'<geom name="{name}" type="plane" size="0 0 1" {place}{axis} {attributes}/>'


def stock_model(scene: Scene, settings: str = "") -> str:
    """A MuJoCo model (XML) of a box on a plane, with planes for the walls.

    Without `settings`, MuJoCo's default contact parameters, solver and cone apply.
    """
    block, mu = scene.block, scene.floor.friction
    planes = "".join(
        plane_of(
            surface,
            0.0,
            f'condim="3" friction="{mu!r} 0 0"' if surface.surface == "floor" else 'condim="1"',
        )
        for surface in surfaces_of(scene)
    )
    (dx, dz), size = (
        block.offset,
        f"{block.half_width!r} {block.half_width!r} {block.half_height!r}",
    )
    place = "" if block.centre_of_mass is None else f'pos="{-dx!r} 0 {-dz!r}" '
    box = f'<geom type="box" {place}size="{size}" condim="1" friction="0 0 0"/>'
    return model_of(scene, planes, box, settings)
