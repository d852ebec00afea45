# %% [markdown]
# # Bring your own rule
#
# A *rule* is asked at every decision. It forbids trajectories, or puts a price on them; safety
# comes first. `docs/rules.md` says what a rule sees. In a mission it is named `module:name`:
#
#     [rules]
#     own = ["own_rule:stay_low"]
#
# or on the command line: `clearway fly static-obstacles --rule own_rule:stay_low`, in this folder.

# %%
import numpy as np

from clearway.avoidance.rules import RuleView, Verdict

LOW_M, PRICE = 2.0, 3.0


def stay_low(view: RuleView) -> Verdict | None:
    """Whoever climbs more than 2 m above the start pays three metres of flight a metre."""
    above = np.maximum(view.samples_m[:, -1, 2] - LOW_M, 0.0)
    if not above.any():
        return None  # Not concerned: then it is not in the log either.
    return Verdict(f"stay below {LOW_M:g} m", price_m=PRICE * above)
