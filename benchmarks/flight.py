"""What free flight costs and how exact it is, beside MuJoCo's Euler and RK4 integrators.

    python -m benchmarks.flight [--repeats 7]

Costs are CPU microseconds of this process for one flight inside compiled code, the smallest of several repeats; what a
whole step of the engine adds is in benchmarks.throughput. MuJoCo (extra ``bench``) steps a single free body with
everything but gravity switched off; its point gravity is a Python callback, which is most of that cost. Errors are
taken against the closed forms of ``tests/oracles``.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable

import numpy as np

from tests.oracles.flight_oracle import Flyer, angle_between, free_rotation, kepler, mp

RATES = (60, 240, 960)
EARTH = [(0.0, 0.0, -9.81)]
MU, SEMI_MAJOR_AXIS, ECCENTRICITY = 100.0, 10.0, 0.5
PERIOD = 2 * math.pi * math.sqrt(SEMI_MAJOR_AXIS**3 / MU)
APOCENTRE = SEMI_MAJOR_AXIS * (1 + ECCENTRICITY)
APOCENTRE_SPEED = math.sqrt(MU / SEMI_MAJOR_AXIS * (1 - ECCENTRICITY) / (1 + ECCENTRICITY))

TUMBLER = Flyer(angular_velocity=(0.05, 5.0, 0.0), inertia=(0.1, 0.2, 0.3))
ORBIT = Flyer((APOCENTRE, 0.0, 0.0), (0.0, APOCENTRE_SPEED, 0.0), points=[((0.0, 0.0, 0.0), MU)])

FLIGHTS = {
    "sphere, uniform gravity": Flyer(angular_velocity=(1.0, 2.0, 3.0), inertia=(0.4, 0.4, 0.4), uniform=EARTH),
    "symmetric, uniform gravity": Flyer(angular_velocity=(1.0, 2.0, 3.0), inertia=(0.4, 0.4, 0.6), uniform=EARTH),
    "triaxial, uniform gravity": Flyer(angular_velocity=(1.0, 2.0, 3.0), inertia=(0.1, 0.2, 0.3), uniform=EARTH),
    "triaxial, 10 rad/s": Flyer(angular_velocity=(5.0, 6.0, 6.2), inertia=(0.1, 0.2, 0.3), uniform=EARTH),
    "sphere, Kepler arc": ORBIT,
    "sphere, Kepler arc and uniform": Flyer(
        ORBIT.center, ORBIT.velocity, points=ORBIT.points, uniform=[(0.0, 0.0, -0.1)]
    ),
}


def cpu_per_step(run: Callable[[int], object], steps: int, repeats: int) -> float:
    """Smallest CPU time [us] of one of ``steps`` steps."""
    run(1)
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run(steps)
        times.append(time.process_time() - start)
    return min(times) / steps * 1e6


def mujoco_body(body: Flyer, integrator: str, rate: int):
    """A MuJoCo model and its data with this body in free flight."""
    import mujoco

    mujoco.set_mjcb_control(None)
    gravity = " ".join(str(x) for x in np.sum([*body.uniform, (0.0, 0.0, 0.0)], axis=0))
    inertia = " ".join(str(x) for x in body.inertia)
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{1 / rate!r}" integrator="{integrator}" gravity="{gravity}">
            <flag contact="disable" constraint="disable"/>
          </option>
          <worldbody><body><freejoint/>
            <inertial pos="0 0 0" mass="{body.mass}" diaginertia="{inertia}"/>
          </body></worldbody>
        </mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[:] = [*body.center, *body.orientation]
    # The angular velocity of a free joint is in the frame of the body, which starts aligned with the world.
    data.qvel[:] = [*body.velocity, *body.angular_velocity]

    def attract(model, data):
        for center, mu in body.points:
            arm = np.array(center) - data.qpos[:3]
            data.qfrc_applied[:3] = body.mass * mu / np.linalg.norm(arm) ** 3 * arm

    if body.points:
        mujoco.set_mjcb_control(attract)
    return model, data


def costs(repeats: int, peers: bool) -> None:
    print(f"{'CPU us a step':34}{'ours':>9}" + ("   MuJoCo Euler   MuJoCo RK4" if peers else ""))
    for name, body in FLIGHTS.items():
        figures = [cpu_per_step(lambda n, body=body: body.after(1 / 240, n), 20000, repeats)]
        for integrator in ("Euler", "RK4") if peers else ():
            import mujoco

            model, data = mujoco_body(body, integrator, 240)
            start = data.qpos.copy(), data.qvel.copy()

            def run(steps, model=model, data=data, start=start):
                # From the start again: left alone, the Euler step of a tumbling body gains energy without end.
                data.qpos[:], data.qvel[:] = start
                mujoco.mj_step(model, data, nstep=steps)

            figures.append(cpu_per_step(run, 2000, repeats))
        print(f"{name:34}{figures[0]:9.3f}" + "".join(f"{f:15.2f}" for f in figures[1:]))


def errors(name: str, body: Flyer, duration: float, error: Callable[[Flyer, float], float], peers: bool) -> None:
    """One line an integrator: the error at the end of ``duration`` [s] at each step size."""
    figures: dict[str, list[float]] = {"ours": []}
    for rate in RATES:
        steps = round(duration * rate)
        figures["ours"].append(error(body.after(1 / rate, steps), steps / rate))
        for integrator in ("Euler", "RK4") if peers else ():
            import mujoco

            model, data = mujoco_body(body, integrator, rate)
            mujoco.mj_step(model, data, nstep=steps)
            end = Flyer(data.qpos[:3].copy(), orientation=data.qpos[3:].copy())
            figures.setdefault(f"MuJoCo {integrator}", []).append(error(end, steps / rate))
    for engine, values in figures.items():
        print(f"{name:34}{engine:14}" + "".join(f"{value:12.1e}" for value in values))


def orientation_error(end: Flyer, duration: float) -> float:
    """Angle [rad] to the elliptic solution."""
    q = [mp.mpf(x) for x in TUMBLER.orientation]
    return angle_between(end.orientation, free_rotation(TUMBLER.inertia, q, TUMBLER.angular_velocity, duration)[0])


def orbit_error(end: Flyer, duration: float) -> float:
    """Distance to the Kepler solution, in semi-major axes."""
    exact = np.array(kepler(ORBIT.center, ORBIT.velocity, MU, duration)[0], float)
    return float(np.linalg.norm(end.center - exact)) / SEMI_MAJOR_AXIS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[0])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--periods", type=float, default=100.0, help="of the orbit; MuJoCo takes minutes for 100")
    arguments = parser.parse_args()
    try:
        import mujoco  # noqa: F401

        peers = True
    except ImportError:
        print("MuJoCo is not installed (pip install 'avalanche-gym[bench]'): our figures alone.")
        peers = False
    costs(arguments.repeats, peers)
    print(f"\n{'error at step 1 /':48}" + "".join(f"{rate:12d}" for rate in RATES))
    errors("free rotation, 20 s [rad]", TUMBLER, 20.0, orientation_error, peers)
    errors(f"orbit, {arguments.periods:g} periods [a]", ORBIT, arguments.periods * PERIOD, orbit_error, peers)


if __name__ == "__main__":
    main()
