"""Accelerations filtered by run-time-assurance; run by the peers' Python, never by clearway.

    python fly_rta.py < questions > answers

Questions and answers are those of `fly_cbfpy.py`, without rates. An implicit simplex: the wished
acceleration passes if braking from the next state keeps out of all balls, else it brakes.
"""

import json
import os
import sys
import time
from collections import OrderedDict

os.environ["JAX_ENABLE_X64"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import jax.numpy as jnp
import numpy as np
from run_time_assurance.constraint import ConstraintModule
from run_time_assurance.controller import RTABackupController
from run_time_assurance.rta import ImplicitSimplexModule

STEP_S, WINDOW_S = 0.2, 2.6
"""One step covers the time in which a copter tilts."""
STILL_MPS = 0.05


class Brake(RTABackupController):
    """Straight on, to a stop."""

    def __init__(self, most):
        self.most = most
        super().__init__()

    def _generate_control(self, state, step_size, controller_state=None):
        velocity = state[3:]
        speed = jnp.sqrt(jnp.sum(velocity**2) + STILL_MPS**2)
        size = jnp.minimum(self.most, speed / step_size)
        return -velocity / speed * size, controller_state


class OutOfBalls(ConstraintModule):
    """Distance to the nearest ball."""

    def _compute(self, state, params):
        away = jnp.linalg.norm(state[:3] - params["middles"], axis=1) - params["radii"]
        return jnp.min(away)


class Copter(ImplicitSimplexModule):
    """A double integrator."""

    def __init__(self, most, balls):
        self.balls = balls
        super().__init__(
            backup_window=WINDOW_S,
            backup_controller=Brake(most),
            control_bounds_high=most,
            control_bounds_low=-most,
            jit_compile_dict={"constraint_violation": True, "pred_state": True, "integrate": True},
        )

    def _setup_constraints(self):
        params = {"middles": jnp.zeros((self.balls, 3)), "radii": jnp.zeros(self.balls)}
        return OrderedDict([("balls", OutOfBalls(params=params))])

    def _pred_state(self, state, step_size, control):
        after = state[3:] + step_size * control
        return jnp.concatenate([state[:3] + 0.5 * step_size * (state[3:] + after), after])


def main():
    """Answer line by line."""
    known = {}
    for line in sys.stdin:
        question = json.loads(line)
        key = question["most"], len(question["radii"])
        if key not in known:
            known[key] = Copter(*key)
        module = known[key]
        state, wished = np.array(question["state"], dtype=float), np.array(question["wished"])
        began = time.process_time()
        for name in ("middles", "radii"):
            module.constraints["balls"].params[name] = jnp.array(question[name], dtype=float)
        found = np.asarray(module.filter_control(state, STEP_S, wished))
        taken = 1e3 * (time.process_time() - began)
        print(json.dumps({"acceleration": found.tolist(), "ms": round(taken, 3)}), flush=True)


if __name__ == "__main__":
    main()
