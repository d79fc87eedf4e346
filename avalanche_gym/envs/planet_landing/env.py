"""PlanetLanding as a batched task, a single environment and a vector environment."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import physics
from ...physics.jit import entry_point
from ...physics.maths import quat, vec3
from ..base import BatchedTask
from ..picture import Picture
from ..single import SingleEnv
from ..vector import NativeVectorEnv
from . import dynamics, scene
from .ground import Ground
from .observation import BOUND, observe_lane
from .reward import TERMS, judge_lane, potential_of

MAX_EPISODE_STEPS = 300


@entry_point
def conclude(
    mask,
    opening,
    lander,
    lanes,
    position,
    orientation,
    linear_velocity,
    angular_velocity,
    terms,
    reward,
    terminated,
    success,
    bound,
    rows,
):
    """Judge and observe the lanes of the mask after a control step; with ``opening`` 1, at the start of an episode.

    ``rows`` are the observations; the other arrays are those of task and world.
    """
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane = lanes[number]
        place = vec3.load(position[number, lander])
        q = quat.load(orientation[number, lander])
        velocity = vec3.load(linear_velocity[number, lander])
        spin = vec3.load(angular_velocity[number, lander])
        if opening == 1:
            lane.potential = potential_of(lane, place, q, velocity, spin)
        else:
            total, over, won = judge_lane(lane, terms[number], place, q, velocity, spin)
            reward[number] = total
            terminated[number] = over
            success[number] = won
        observe_lane(rows[number], bound, lane, place, q, velocity, spin)


class PlanetLandingTask(BatchedTask):
    """See PlanetLandingEnv."""

    name = "PlanetLanding"
    action_size = 4
    term_names = TERMS
    control_interval = 0.1
    max_thrust = dynamics.MAX_THRUST
    default_options = physics.Options(time_step=0.02, sleeping=False)
    level_ranges = scene.LEVELS
    draws = scene.DRAWS
    lane_dtype = scene.LANE
    observation_bound = BOUND

    def build_scene(self) -> physics.Scene:
        self.planet = scene.planet_of(self.level)
        built, self.lander = scene.build_scene(self.planet)
        ground = Ground(self.planet, scene.SUBDIVISIONS)
        self._ground = (ground.directions, ground.faces, ground.centers, ground.planes)
        body = built.bodies[self.lander]
        assert body is not None
        self._inertia = np.ascontiguousarray(np.diagonal(body.inertia))
        self._starts = np.zeros(self.num_envs, scene.START)
        return built

    def start(self, mask: NDArray[np.bool_], draws: NDArray[np.float64]) -> None:
        scene.begin(mask, draws, self.range_record, self.lanes, self._starts)
        chosen = self._starts[mask]
        self.world.set_state(self.lander, world=mask, **{name: chosen[name] for name in scene.START.names or ()})

    def observe(self, mask: NDArray[np.bool_]) -> None:
        self._watch(mask, 1)
        self._conclude(mask, 1)

    def advance(self, actions: NDArray[np.float64]) -> None:
        world = self.world
        failures: dict[int, tuple[int, str, int, str]] = {}  # by lane, its first one
        for number in range(self.num_steps):
            dynamics.thrust(
                actions,
                number,
                self.control_interval,
                self.options.time_step,
                self.lander,
                self._inertia,
                self.lanes,
                world.orientation,
                world.impulse_buffer,
            )
            try:
                world.step()
            except physics.PhysicsError as failed:
                for lane, body, _, reason in failed.failures:
                    failures.setdefault(lane, (lane, body, number, reason))
            self._watch(self.every_lane, 0)
        self._conclude(self.every_lane, 0)
        if failures:
            raise physics.PhysicsError(list(failures.values()))

    def _watch(self, mask: NDArray[np.bool_], opening: int) -> None:
        world = self.world
        dynamics.watch(
            mask,
            opening,
            self.lander,
            self.lanes,
            world.position,
            world.orientation,
            world.linear_velocity,
            *self._ground,
        )

    def _conclude(self, mask: NDArray[np.bool_], opening: int) -> None:
        world = self.world
        conclude(
            mask,
            opening,
            self.lander,
            self.lanes,
            world.position,
            world.orientation,
            world.linear_velocity,
            world.angular_velocity,
            self.terms,
            self.reward,
            self.terminated,
            self.success,
            self.observation_bound,
            self.observation,
        )

    def make_picture(self) -> Picture:
        from .picture import PlanetLandingPicture  # here, since environments that draw nothing need no renderer

        return PlanetLandingPicture(self)


class PlanetLandingEnv(SingleEnv):
    """
    ## Description

    A lander, a hull on four legs, flies above a small bumpy planet at about the speed of a circular orbit. One engine
    pushes along its body axis, attitude impulses turn it, and the tank is small: brake, turn upright, come down softly
    and stand still. It follows the small planet demo of the original Avalanche Engine.

    Planet: radius 20 m, an icosphere of 5120 facets, gravity mu / r^2 with mu = 400 m^3/s^2, which is 1 m/s^2 on the
    ground. The relief is that of the level and the same in every episode; the start is not. Lander: 10 kg, feet 1.4 m
    apart along the diagonal and 0.56 m below the middle of the hull. A step lasts 0.1 s, five physics steps of 0.02 s.

    ## Action Space

    `Box(-1, 1, (4,), float32)`; actions outside are clipped, NaN is an error:

    | Index | Action | At 1 |
    |---|---|---|
    | 0 | impulse along the body axis, from none at -1 to full at 1 | 2.5 N s a kg a second: 2.5 m/s^2 |
    | 1 to 3 | angular impulse about the body axes x, y, z | changes the angular velocity by 0.2 rad/s a step |

    The impulses are spread over the physics steps of a control step. Turning costs no fuel.

    ## Observation Space

    `Box(-bound, bound, (21,), float32)`, clipped into the bounds; vectors are in the frame of the lander:

    | Index | Observation | Unit | Bound |
    |---|---|---|---|
    | 0 | altitude of the feet above the ground | 5 m | 10 |
    | 1, 2 | vertical and horizontal speed | 4 m/s | 5 |
    | 3 to 5 | velocity | 4 m/s | 5 |
    | 6 to 8 | vertical | | 1 |
    | 9 to 11 | angular velocity | 1 rad/s | 10 |
    | 12 | fuel left, share of a full tank | | 1 |
    | 13 to 16 | clearance of each foot | 0.5 m | 2 |
    | 17 | 1 if a foot is down: closer to the ground than 0.02 m | | 1 |
    | 18 to 20 | way along the ground to the site; zero on level easy | 5 m | 10 |

    ## Rewards

    The sum of the terms in `info["reward_terms"]`:

    - `shaping`: the increase of a potential, which is minus the sum of: 1 per metre of altitude; 2 per m/s of velocity
      that differs from a descent at 0.35 m/s a metre of altitude (0.3 to 1.5 m/s; 0 on the ground); 3 per
      radian of tilt, less at altitude; 0.5 per rad/s of spin; 0.5 per metre to the site; and minus 2 for each foot on
      the ground. The step of a crash earns none,
    - `fuel`: -0.05 per m/s of fuel burnt,
    - `time`: -0.03 for each step,
    - `rest`: 0.3 for each step of a rest, taken back when the rest is broken,
    - `success`: 15, `crash`: -10, `escape`: -10.

    ## Starting State

    At a random place above the planet, flying horizontally with a random heading:

    | | easy | medium | hard |
    |---|---|---|---|
    | relief, largest height of the bumps [m] | 0.1 | 0.4 | 0.7 |
    | `altitude` above the mean radius [m] | 5 to 7 | 5 to 8 | 5 to 9 |
    | `speed`, in units of the circular speed | 0.9 to 1 | 0.9 to 1.05 | 0.9 to 1.1 |
    | `tilt` of the body axis [rad] | 0 to 0.2 | 0 to 0.6 | 0 to 1.5 |
    | `spin` [rad/s] | 0 | 0 to 0.3 | 0.2 to 0.8 |
    | `fuel`, change of speed that the tank holds [m/s] | 30 | 24 | 20 |
    | `site_distance` along the ground, ahead [m] | | 8 to 14 | 8 to 20 |
    | `site_angle` off the heading [rad] | | -0.5 to 0.5 | -1 to 1 |
    | `site_radius` [m], the first number counts; 0: land anywhere | 0 | 5 | 2.5 |

    ## Episode End

    - Termination: success (`info["is_success"]`): at rest for one second, that is three feet down, slower than 0.05 m/s
      and 0.1 rad/s, tilted by less than 15 degrees, inside the site if there is one, and every touch of the ground was
      slower than 0.8 m/s.
    - Termination: crash, a touch at 0.8 m/s or more, or a tilt of more than 45 degrees while touching.
    - Termination: escape, more than 20 m above the ground.
    - Truncation: after 300 steps (30 s), or when the physics failed (`info["physics_error"]` says how).

    ## Arguments

    - `level`: "easy" (default), "medium" or "hard".
    - `ranges`: `{name: (low, high)}` replaces ranges of the level (names as above): domain randomisation.
    - `options`: `avalanche_gym.physics.Options`; its `time_step` must be 0.1 s / n.
    - `render_mode`: `None`, "rgb_array", or "human": a window (extra `render`).
    - `reset(options={"state": env.unwrapped.get_state()})` starts from a given state.

    ## Version History

    - v0: first version.
    """

    task_class: ClassVar[type[BatchedTask]] = PlanetLandingTask


class PlanetLandingVectorEnv(NativeVectorEnv):
    """Many lanes of PlanetLandingEnv in a few kernel calls a step; see there."""

    task_class: ClassVar[type[BatchedTask]] = PlanetLandingTask
    default_episode_steps: ClassVar[int] = MAX_EPISODE_STEPS
