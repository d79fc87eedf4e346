"""PushTerrain as a batched task, a single environment and a vector environment."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import physics
from ...physics.jit import entry_point
from ...physics.maths import quat, vec3
from ..base import BatchedTask
from ..picture import Picture
from ..single import SingleEnv
from ..vector import NativeVectorEnv
from . import scene
from .observation import BOUND, observe_lane
from .reward import TERMS, judge_lane, remember

MAX_IMPULSE = 0.12  # [N s] a step along x and y at action 1: a force of 6 N
MAX_EPISODE_STEPS = 300


@entry_point
def push(actions, pusher, impulses):
    """Write the impulses [N s] of a step."""
    for lane in range(actions.shape[0]):
        for axis in range(2):
            impulses[lane, pusher, axis] = MAX_IMPULSE * min(max(actions[lane, axis], -1.0), 1.0)


@entry_point
def conclude(
    mask,
    opening,
    pusher,
    body,
    lanes,
    heights,
    position,
    orientation,
    linear_velocity,
    angular_velocity,
    actions,
    terms,
    reward,
    terminated,
    success,
    bound,
    rows,
):
    """Judge and observe the lanes of the mask after a step; with ``opening`` 1, at the start of an episode.

    ``pusher`` and ``body`` are handles; ``rows`` are the observations; the other arrays are those of task and world.
    """
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane = lanes[number]
        ball = vec3.load(position[number, pusher])
        box = vec3.load(position[number, body])
        box_velocity = vec3.load(linear_velocity[number, body])
        if opening == 1:
            remember(lane, ball, box)
        else:
            total, over, won = judge_lane(lane, terms[number], actions[number], ball, box, box_velocity)
            reward[number] = total
            terminated[number] = over
            success[number] = won
        observe_lane(
            rows[number],
            bound,
            lane,
            ball,
            vec3.load(linear_velocity[number, pusher]),
            box,
            quat.load(orientation[number, body]),
            box_velocity,
            vec3.load(angular_velocity[number, body]),
            heights[number],
        )


class PushTerrainTask(BatchedTask):
    """See PushTerrainEnv."""

    name = "PushTerrain"
    action_size = 2
    term_names = TERMS
    control_interval = 0.02
    # Made for learning: what the tolerance leaves, and impacts at the end of their step, are less than the step itself
    # leaves (docs/environments/push_terrain.md).
    default_options = physics.Options(time_step=0.005, tolerance=1e-4, events=False, sleeping=False)
    level_ranges = scene.LEVELS
    draws = scene.DRAWS
    lane_dtype = scene.LANE
    observation_bound = BOUND

    def build_scene(self) -> physics.Scene:
        built, self.ground, self.pusher, self.body = scene.build_scene()
        self.heights = np.zeros((self.num_envs, scene.SAMPLES, scene.SAMPLES))
        self._starts = np.zeros(self.num_envs, scene.START)
        return built

    def start(self, mask: NDArray[np.bool_], draws: NDArray[np.float64]) -> None:
        world, starts = self.world, self._starts
        scene.begin(mask, draws, self.range_record, self.lanes, self.heights, starts)
        chosen = starts[mask]
        world.set_heights(self.ground, self.heights[mask], world=mask)
        world.set_state(self.pusher, position=chosen["pusher_position"], world=mask)
        world.set_state(self.body, position=chosen["body_position"], orientation=chosen["body_orientation"], world=mask)
        world.set_parameters(self.body, mass=chosen["body_mass"], friction=chosen["body_friction"], world=mask)

    def observe(self, mask: NDArray[np.bool_]) -> None:
        self._conclude(mask, 1, self.no_actions)

    def advance(self, actions: NDArray[np.float64]) -> None:
        push(actions, self.pusher, self.world.impulse_buffer)
        try:
            self.world.step(self.num_steps)
        finally:
            self._conclude(self.every_lane, 0, actions)

    def lane_arrays(self) -> dict[str, NDArray[Any]]:
        return {"lanes": self.lanes, "heights": self.heights}

    def make_picture(self) -> Picture:
        from .picture import PushTerrainPicture  # here, since environments that draw nothing need no renderer

        return PushTerrainPicture(self)

    def _conclude(self, mask: NDArray[np.bool_], opening: int, actions: NDArray[np.float64]) -> None:
        world = self.world
        conclude(
            mask,
            opening,
            self.pusher,
            self.body,
            self.lanes,
            self.heights,
            world.position,
            world.orientation,
            world.linear_velocity,
            world.angular_velocity,
            actions,
            self.terms,
            self.reward,
            self.terminated,
            self.success,
            self.observation_bound,
            self.observation,
        )


class PushTerrainEnv(SingleEnv):
    """
    ## Description

    A ball, the pusher, stands on uneven ground beside a box, the body. Impulses roll the ball; it has to push the box
    into the goal, a circle on the ground. The terrain is a shallow bowl with waves, concave almost everywhere and new
    in each episode. It follows the terrain demo of the original Avalanche Engine.

    Ball: radius 0.15 m, 1 kg. Box: 0.4 x 0.4 x 0.3 m. Ground: 8 x 8 m, 33 x 33 heights. A step lasts 0.02 s, four
    physics steps of 5 ms.

    ## Action Space

    `Box(-1, 1, (2,), float32)`: the impulse on the pusher along x and y of the world, in units of 0.12 N s a step, a
    force of 6 N. Actions outside are clipped; NaN is an error.

    ## Observation Space

    `Box(-bound, bound, (47,), float32)`, axes of the world, clipped into the bounds:

    | Index | Observation | Unit | Bound |
    |---|---|---|---|
    | 0 to 2 | pusher minus body | 1 m | 10 |
    | 3 to 5 | velocity of the pusher | 1 m/s | 5 |
    | 6, 7 | goal minus body, x and y | 1 m | 10 |
    | 8, 9 | direction from body to goal | | 1 |
    | 10 to 12 | velocity of the body | 1 m/s | 5 |
    | 13 to 18 | x and z axes of the body | | 1 |
    | 19 to 21 | angular velocity of the body | 5 rad/s | 5 |
    | 22 to 46 | heights of 5 x 5 points around the body, 0.3 m apart, above the ground below it | 0.2 m | 10 |

    ## Rewards

    The sum of the terms in `info["reward_terms"]`:

    - `progress`: 4 per metre that the body came closer to the goal,
    - `approach`: 1 per metre that the pusher came closer to the point 0.3 m behind the body, as seen from the goal,
    - `effort`: -0.002 times the mean square of the action,
    - `success`: 5 at success,
    - `lost`: -5 when pusher or body leaves the terrain.

    ## Starting State

    The body rests within a radius of the middle, the goal lies at a random direction and distance from it, the pusher
    stands behind the body, give or take an angle. All ranges are those of the level:

    | | easy | medium | hard |
    |---|---|---|---|
    | `curvature` of the bowl [1/m] | 0.01 to 0.03 | 0.02 to 0.06 | 0.02 to 0.10 |
    | `roughness`, amplitude of each of five waves [m] | 0 to 0.01 | 0.01 to 0.03 | 0.02 to 0.06 |
    | `wavelength` [m] | 2 to 4 | 1.5 to 4 | 1.2 to 3 |
    | `body_distance` from the middle [m] | 0 to 0.5 | 0 to 0.8 | 0 to 1 |
    | `goal_distance` from the body [m] | 0.7 to 1 | 0.8 to 1.5 | 1 to 2 |
    | `goal_radius` [m], the first number counts | 0.4 | 0.35 | 0.3 |
    | `pusher_distance` from the body [m] | 0.45 to 0.55 | 0.5 to 0.8 | 0.5 to 1 |
    | `pusher_angle` off the line behind the body [rad] | -0.2 to 0.2 | -1.5 to 1.5 | any |
    | `yaw` of the body against the direction to the goal [rad] | -0.2 to 0.2 | any | any |
    | `body_mass` [kg] | 0.5 | 0.4 to 0.7 | 0.3 to 1 |
    | `body_friction` | 0.5 | 0.4 to 0.6 | 0.35 to 0.7 |

    ## Episode End

    - Termination: success, the middle of the body is inside the goal and slower than 0.2 m/s (`info["is_success"]`); or
      pusher or body is less than 0.4 m from the rim of the terrain.
    - Truncation: after 300 steps (6 s), or when the physics failed (`info["physics_error"]` says how).

    ## Arguments

    - `level`: "easy" (default), "medium" or "hard".
    - `ranges`: `{name: (low, high)}` replaces ranges of the level (names as above): domain randomisation.
    - `options`: `avalanche_gym.physics.Options`; its `time_step` must be 0.02 s / n. `None` is
      `Options(time_step=0.005, tolerance=1e-4, events=False, sleeping=False)`.
    - `render_mode`: `None`, "rgb_array", or "human": a window (extra `render`).
    - `reset(options={"state": env.unwrapped.get_state()})` starts from a given state.

    ## Version History

    - v0: first version.
    """

    task_class: ClassVar[type[BatchedTask]] = PushTerrainTask


class PushTerrainVectorEnv(NativeVectorEnv):
    """Many lanes of PushTerrainEnv in one kernel call a step; see there."""

    task_class: ClassVar[type[BatchedTask]] = PushTerrainTask
    default_episode_steps: ClassVar[int] = MAX_EPISODE_STEPS
