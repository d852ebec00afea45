"""Accelerations filtered by cbfpy; run by the peers' Python, never imported by clearway.

    python fly_cbfpy.py < questions > answers

A question is a line of JSON: `state` [6] position and velocity, `wished` [3] acceleration, `most`
its limit along each axis, `middles` [k, 3] and `radii` [k] of balls to keep out of, and the two
`rates` of the barrier. An answer is `acceleration` [3], null where none was found, and the CPU `ms`
that it took. Barriers of relative degree two for a double integrator: one for each ball.
"""

import json
import os
import sys
import time

# As cbfpy recommends, before it is imported.
os.environ["JAX_ENABLE_X64"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import jax.numpy as jnp
import numpy as np
from cbfpy import CBF, CBFConfig

ASKED = ("state", "wished", "middles", "radii")


class Balls(CBFConfig):
    """A double integrator that keeps out of balls."""

    def __init__(self, question):
        self.rates = question["rates"]
        seed = jnp.array(question["middles"]), jnp.array(question["radii"])
        most = question["most"] * np.ones(3)
        super().__init__(n=6, m=3, u_min=-most, u_max=most, init_args=seed)

    def f(self, z, *_balls):
        """Velocity moves the position."""
        return jnp.concatenate([z[3:], jnp.zeros(3)])

    def g(self, _z, *_balls):
        """Acceleration changes the velocity."""
        return jnp.concatenate([jnp.zeros((3, 3)), jnp.eye(3)])

    def h_2(self, z, middles, radii):
        """Distance to each ball."""
        return jnp.linalg.norm(z[:3] - middles, axis=1) - radii

    def alpha(self, h, *_balls):
        """How fast the barrier of relative degree one may fall."""
        return self.rates[1] * h

    def alpha_2(self, h_2, *_balls):
        """How fast the distance may fall."""
        return self.rates[0] * h_2


def main():
    """Answer line by line."""
    known = {}
    for line in sys.stdin:
        question = json.loads(line)
        key = (*question["rates"], question["most"], len(question["radii"]))
        if key not in known:
            known[key] = CBF.from_config(Balls(question))
        values = [np.array(question[name], dtype=float) for name in ASKED]
        began = time.process_time()
        found = np.asarray(known[key].safety_filter(*values))
        taken = 1e3 * (time.process_time() - began)
        answer = {"acceleration": found.tolist() if np.isfinite(found).all() else None}
        print(json.dumps(answer | {"ms": round(taken, 3)}), flush=True)


if __name__ == "__main__":
    main()
