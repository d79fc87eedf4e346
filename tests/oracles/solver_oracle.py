"""The contact solver, slow and obvious: dense matrices, one residual, projected Gauss-Seidel; and islands to try it on.

Only ``Island.solve`` and ``Island.project`` call the engine. The Delassus matrix is assembled from Jacobians in world
coordinates, the residual is the natural map of the De Saxce formulation (as in
``avalanche_gym/physics/solver/residual.py``), and the solution comes from many small projections.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from avalanche_gym.physics import model
from avalanche_gym.physics.solver.exact import NEEDS_MEMORY, solve_island
from avalanche_gym.physics.solver.projection import project_island
from avalanche_gym.physics.solver.workspace import Workspace

GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s^2]


def rotation_matrix(q: np.ndarray) -> np.ndarray:
    """(3, 3) matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def cross_matrix(a: np.ndarray) -> np.ndarray:
    """[a]: [a] b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@dataclass
class Island:
    """A list of bodies and contacts, turned into the engine's records on demand."""

    bodies: list[dict] = field(default_factory=list)
    contacts: list[dict] = field(default_factory=list)

    def body(
        self,
        center=(0.0, 0.0, 0.0),
        mass=1.0,
        inertia=(1.0, 1.0, 1.0),
        motion=model.DYNAMIC,
        orientation=(1.0, 0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 0.0),
    ) -> int:
        """Add a body; inertia 0 about an axis means it can't turn about it. Returns its handle."""
        self.bodies.append(
            {
                "motion": motion,
                "mass": mass,
                "inertia": np.array(inertia, float),
                "center": np.array(center, float),
                "orientation": np.array(orientation, float) / np.linalg.norm(orientation),
                "velocity": np.array(velocity, float),
                "angular_velocity": np.array(angular_velocity, float),
            }
        )
        return len(self.bodies) - 1

    def box(self, center, half, mass=1.0, **options) -> int:
        """Add a box of half extents ``half`` [m]."""
        x, y, z = half
        inertia = mass / 3.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
        return self.body(center, mass, inertia, **options)

    def ground(self) -> int:
        return self.body(motion=model.STATIC)

    def contact(
        self, a, b, position, normal, friction=0.5, bias=0.0, impulse=(0.0, 0.0, 0.0), surface_velocity=(0.0, 0.0, 0.0)
    ) -> None:
        normal = np.array(normal, float)
        self.contacts.append(
            {
                "body_a": a,
                "body_b": b,
                "position": np.array(position, float),
                "normal": normal / np.linalg.norm(normal),
                "friction": friction,
                "bias": bias,
                "impulse": np.array(impulse, float),
                "surface_velocity": np.array(surface_velocity, float),
            }
        )

    def face(self, a, b, center, half, friction=0.5, **options) -> None:
        """Four contacts at the corners of a horizontal rectangle, b above a."""
        for sx, sy in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
            position = np.array(center, float) + np.array([sx * half[0], sy * half[1], 0.0])
            self.contact(a, b, position, (0.0, 0.0, 1.0), friction, **options)

    def accelerate(self, acceleration, duration) -> None:
        """Add acceleration x duration to the velocity of every dynamic body."""
        for body in self.bodies:
            if body["motion"] == model.DYNAMIC:
                body["velocity"] = body["velocity"] + np.asarray(acceleration) * duration

    def records(self):
        """``contacts, order, bodies, states, island_bodies`` as the kernels take them."""
        bodies = np.zeros(len(self.bodies), model.BODY)
        states = np.zeros(len(self.bodies), model.BODY_STATE)
        for i, body in enumerate(self.bodies):
            bodies[i]["motion"] = body["motion"]
            if body["motion"] == model.DYNAMIC:
                bodies[i]["mass"] = body["mass"]
                bodies[i]["inverse_mass"] = 1.0 / body["mass"]
                bodies[i]["inertia"] = body["inertia"]
                with np.errstate(divide="ignore"):
                    inverse = 1.0 / body["inertia"]
                bodies[i]["inverse_inertia"] = np.where(np.isfinite(inverse), inverse, 0.0)
            for name in ("center", "orientation", "velocity", "angular_velocity"):
                states[i][name] = body[name]
        contacts = np.zeros(len(self.contacts), model.CONTACT)
        for i, contact in enumerate(self.contacts):
            for name, value in contact.items():
                contacts[i][name] = value
        order = np.arange(len(contacts))
        island_bodies = np.flatnonzero(bodies["motion"] == model.DYNAMIC)
        return contacts, order, bodies, states, island_bodies

    def solve(self, tolerance=1e-12, max_iterations=60) -> Solution:
        """What the engine makes of this island."""
        return _run(self, lambda records, arrays: _solve(records, tolerance, max_iterations, arrays))

    def project(self, gaps, most_overlap=np.inf, tolerance=1e-12, max_iterations=60) -> Solution:
        """The displacements by which the engine removes the overlaps ``gaps`` [m]."""

        def call(records, arrays):
            contacts, order, bodies, states, island_bodies = records
            contacts["gap"] = gaps
            result = project_island(
                contacts, order, len(contacts), bodies, states, island_bodies, len(island_bodies),
                most_overlap, tolerance, max_iterations, *arrays,
            )  # fmt: skip
            states["velocity"][island_bodies] = arrays[1]["linear"][: len(island_bodies)]
            states["angular_velocity"][island_bodies] = arrays[1]["angular"][: len(island_bodies)]
            return result

        return _run(self, call)


@dataclass
class Solution:
    """Attributes: impulses (n, 3) [N s]; velocities (bodies, 6), or displacements if it is of a projection."""

    residual: float
    iterations: int
    method: int
    impulses: np.ndarray
    velocities: np.ndarray


def _solve(records, tolerance, max_iterations, arrays):
    contacts, order, bodies, states, island_bodies = records
    return solve_island(
        contacts, order, len(contacts), bodies, states, island_bodies, len(island_bodies),
        tolerance, max_iterations, *arrays,
    )  # fmt: skip


def _run(island: Island, call) -> Solution:
    """Call a solver and repeat with more memory for as long as it asks for it."""
    workspace = Workspace(len(island.contacts), len(island.bodies))
    while True:
        records = island.records()
        residual, iterations, method = call(records, workspace.arrays)
        if method != NEEDS_MEMORY:
            break
        workspace.grow()
    contacts, _, _, states, _ = records
    velocities = np.concatenate([states["velocity"], states["angular_velocity"]], axis=1)
    return Solution(residual, iterations, method, contacts["impulse"].copy(), velocities)


@dataclass
class Problem:
    """u = W r + w with the contact law between u_i and r_i, everything in world vectors.

    Attributes:
        delassus: (3n, 3n) [1/kg]; free: (3n,) [m/s]; normals: (n, 3); friction: (n,); response: (6 bodies, 3n), M^-1
        J^T.
    """

    delassus: np.ndarray
    free: np.ndarray
    normals: np.ndarray
    friction: np.ndarray
    response: np.ndarray

    def split(self, vectors):
        """Normal part (n,) and tangential vectors (n, 3)."""
        along = np.einsum("ij,ij->i", vectors, self.normals)
        return along, vectors - along[:, None] * self.normals

    @property
    def scale(self):
        return np.array(
            [np.trace(self.delassus[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]) / 3 for i in range(len(self.normals))]
        )

    def project(self, vectors):
        """Nearest points of the friction cones."""
        along, tangential = self.split(vectors)
        slip = np.linalg.norm(tangential, axis=1)
        foot = np.maximum(along + self.friction * slip, 0.0) / (1 + self.friction**2)
        with np.errstate(all="ignore"):
            ratio = np.where(slip > 0, self.friction * foot / slip, 0.0)
        surface = foot[:, None] * self.normals + ratio[:, None] * tangential
        inside = (along >= 0) & (slip <= self.friction * along)
        return np.where(inside[:, None], vectors, surface)

    def natural_map(self, impulses):
        velocities = (self.delassus @ impulses.ravel() + self.free).reshape(-1, 3)
        _, tangential = self.split(velocities)
        corrected = velocities + (self.friction * np.linalg.norm(tangential, axis=1))[:, None] * self.normals
        return impulses - self.project(impulses - corrected / self.scale[:, None])

    def violation(self, impulses):
        return np.sqrt(np.sum(self.scale[:, None] * self.natural_map(impulses) ** 2))

    def residual(self, impulses):
        """Relative residual of impulses (n, 3)."""
        size = max(np.sqrt(np.sum(self.scale[:, None] * impulses**2)), self.violation(np.zeros_like(impulses)))
        return self.violation(impulses) / size if size > 0 else 0.0

    def solve(self, sweeps=20000, accuracy=1e-13):
        """Gauss-Seidel in which every contact takes damped projection steps of its own until they stop changing it."""
        n = len(self.normals)
        impulses = np.zeros((n, 3))
        weight = [1.0 / np.linalg.norm(self.delassus[3 * i : 3 * i + 3, 3 * i : 3 * i + 3], 2) for i in range(n)]
        for k in range(sweeps):
            for i in range(n):
                block = slice(3 * i, 3 * i + 3)
                others = self.delassus[block] @ impulses.ravel() + self.free[block]
                others -= self.delassus[block, block] @ impulses[i]
                normal, mu = self.normals[i], self.friction[i]
                one = Problem(np.zeros((3, 3)), np.zeros(3), normal[None], np.array([mu]), np.zeros((0, 3)))
                r = impulses[i]
                for _ in range(200):
                    u = self.delassus[block, block] @ r + others
                    slip = u - (u @ normal) * normal
                    new = one.project((r - weight[i] * (u + mu * np.linalg.norm(slip) * normal))[None])[0]
                    moved = np.linalg.norm(new - r)
                    r = new
                    if moved <= 1e-16 * np.linalg.norm(r):
                        break
                impulses[i] = r
            if k % 10 == 9 and self.residual(impulses) < accuracy:
                break
        return impulses


def problem_of(island: Island) -> Problem:
    """The dense contact problem of an island."""
    count = len(island.bodies)
    inverse = np.zeros((6 * count, 6 * count))
    velocities = np.zeros(6 * count)
    for i, body in enumerate(island.bodies):
        velocities[6 * i : 6 * i + 3] = body["velocity"]
        velocities[6 * i + 3 : 6 * i + 6] = body["angular_velocity"]
        if body["motion"] == model.DYNAMIC:
            rotation = rotation_matrix(body["orientation"])
            diagonal = np.array([1.0 / x if x > 0 else 0.0 for x in body["inertia"]])
            inverse[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = np.eye(3) / body["mass"]
            inverse[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = rotation @ np.diag(diagonal) @ rotation.T
    jacobian = np.zeros((3 * len(island.contacts), 6 * count))
    extra = np.zeros(3 * len(island.contacts))
    for k, contact in enumerate(island.contacts):
        for handle, sign in ((contact["body_a"], -1.0), (contact["body_b"], 1.0)):
            arm = contact["position"] - island.bodies[handle]["center"]
            jacobian[3 * k : 3 * k + 3, 6 * handle : 6 * handle + 3] += sign * np.eye(3)
            jacobian[3 * k : 3 * k + 3, 6 * handle + 3 : 6 * handle + 6] += -sign * cross_matrix(arm)
        extra[3 * k : 3 * k + 3] = contact["surface_velocity"] + contact["bias"] * contact["normal"]
    response = inverse @ jacobian.T
    return Problem(
        jacobian @ response,
        jacobian @ velocities + extra,
        np.array([c["normal"] for c in island.contacts]).reshape(-1, 3),
        np.array([c["friction"] for c in island.contacts]),
        response,
    )


# --- Islands
# -------------------------------------------------------------------------------------------------------------


def stack(count=10, half=0.1, mass=1.0, top=1.0, friction=0.5, duration=1 / 60) -> Island:
    """Boxes on each other on the ground, the last ``top`` times as heavy, after ``duration`` [s] of free fall."""
    island = Island()
    below = island.ground()
    for i in range(count):
        box = island.box((0, 0, (2 * i + 1) * half), (half, half, half), mass * (top if i == count - 1 else 1.0))
        island.face(below, box, (0, 0, 2 * i * half), (half, half), friction)
        below = box
    island.accelerate(GRAVITY, duration)
    return island


def pyramid(rows=6, half=0.1, friction=0.5, duration=1 / 60, top=1.0) -> Island:
    """Boxes in rows of ``rows``, ``rows`` - 1, ... 1, each on two below."""
    island = Island()
    ground = island.ground()
    below: list[int] = []
    for level in range(rows):
        count = rows - level
        here = [
            island.box(
                ((2 * i + level) * half, 0, (2 * level + 1) * half), (half,) * 3, top if level == rows - 1 else 1.0
            )
            for i in range(count)
        ]
        z = 2 * level * half
        for i, box in enumerate(here):
            x = (2 * i + level) * half
            if level == 0:
                island.face(ground, box, (x, 0, z), (half, half), friction)
            else:
                island.face(below[i], box, (x - half / 2, 0, z), (half / 2, half), friction)
                island.face(below[i + 1], box, (x + half / 2, 0, z), (half / 2, half), friction)
        below = here
    island.accelerate(GRAVITY, duration)
    return island


def random_island(rng: np.random.Generator, bodies=4, contacts=10, ratio=1.0, friction=None) -> Island:
    """Random bodies and contacts without any geometry behind them: every body is somewhere in a box of 2 m.

    Normals point from the first centre to the second within 60 degrees, so that bodies can be pressed together.
    """
    island = Island()
    ground = island.ground()
    for _ in range(bodies):
        mass = float(ratio ** rng.uniform())
        moments = mass * 0.02 * rng.uniform(0.5, 1.0, 3)
        island.body(
            rng.uniform(-1, 1, 3) + np.array([0.0, 0.0, 1.0]),
            mass,
            moments,
            orientation=rng.normal(size=4),
            velocity=rng.normal(size=3) * 0.3,
            angular_velocity=rng.normal(size=3),
        )
    for _ in range(contacts):
        b = int(rng.integers(1, bodies + 1))
        a = int(rng.integers(0, bodies + 1))
        if a == b:
            a = ground
        center_b = island.bodies[b]["center"]
        if a == ground:
            position = center_b + rng.uniform(-0.1, 0.1, 3) - (0, 0, 0.1)
            normal = np.array([0, 0, 1.0]) + rng.uniform(-0.3, 0.3, 3)
        else:
            middle = 0.5 * (center_b + island.bodies[a]["center"])
            position = middle + rng.uniform(-0.1, 0.1, 3)
            normal = center_b - island.bodies[a]["center"]
            normal = normal / np.linalg.norm(normal) + rng.uniform(-0.3, 0.3, 3)
        mu = float(rng.choice([0.0, 0.3, 0.8])) if friction is None else friction
        island.contact(a, b, position, normal, mu, bias=float(rng.uniform(0, 0.05)) * float(rng.integers(0, 2)))
    island.accelerate(GRAVITY, 1 / 60)
    return island
