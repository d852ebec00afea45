"""What the autopilot tells of its own accuracy: it widens the margin."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as ardupilot

from clearway.avoidance.plan.situation import margin_m
from mavlink_for_tests import Bench


def covariance(size, variances):
    """The upper triangle of a covariance, row by row."""
    full = np.diag([*variances, *[0.01] * (size - len(variances))])
    return full[np.triu_indices(size)].tolist()


def told_accuracy(kind, variances=(0.04, 0.09, 0.01), turns=(0.0004, 0.0001, 0.0009)):
    """A message that tells how sure the autopilot is."""
    if kind == "LOCAL_POSITION_NED_COV":
        return ardupilot.MAVLink_local_position_ned_cov_message(
            0, 0, *[0.0] * 9, covariance(9, variances)
        )
    if kind == "ODOMETRY":
        pose = covariance(6, (*variances, *turns))
        turned = [1.0, 0.0, 0.0, 0.0]
        return ardupilot.MAVLink_odometry_message(
            0, 1, 8, 0.0, 0.0, 0.0, turned, *[0.0] * 6, pose, pose, 0, 0
        )
    if kind == "ESTIMATOR_STATUS":
        return ardupilot.MAVLink_estimator_status_message(0, 0, *[0.1] * 6, 0.3, 0.2)
    return ardupilot.MAVLink_ekf_status_report_message(0, 0.1, 0.12, 0.1, 0.1, 0.1, 0.1)


@pytest.mark.parametrize("kind", ["LOCAL_POSITION_NED_COV", "ODOMETRY", "ESTIMATOR_STATUS"])
def test_what_the_autopilot_states_of_its_accuracy_widens_the_margin(kind):
    bench = Bench()
    bench.all_well(1.0)
    bench.tick(1.5, told_accuracy(kind))
    bench.all_well(2.0)
    unsure, _ = bench.system.situation(2.0)
    assert unsure.state.position_std_m == pytest.approx(0.3)
    settings = bench.system.planner.settings
    assert margin_m(settings, unsure) == pytest.approx(settings.safety_margin_m + 3.0 * 0.3)
    attitude = 0.03 if kind == "ODOMETRY" else 0.0
    assert unsure.state.attitude_std_rad == pytest.approx(attitude)


@pytest.mark.parametrize(("ratio", "std_m"), [(0.2, 0.0), (0.8, 2.0)])
def test_an_estimator_that_doubts_itself_widens_the_margin(ratio, std_m):
    bench = Bench()
    bench.all_well(1.0)
    bench.tick(1.5, ardupilot.MAVLink_ekf_status_report_message(0, 0.1, ratio, 0.1, 0.1, 0.1, 0.1))
    bench.all_well(2.0)
    situation, _ = bench.system.situation(2.0)
    assert situation.state.position_std_m == pytest.approx(std_m)
    assert bool(bench.counts["position: doubted by the autopilot's estimator"]) == (std_m > 0.0)


@pytest.mark.parametrize("flaw", [float("nan"), -1.0])
def test_an_accuracy_that_is_none_changes_nothing_and_is_counted(flaw):
    bench = Bench(position_std_m=0.1)
    bench.all_well(1.0)
    bench.tick(1.5, told_accuracy("LOCAL_POSITION_NED_COV", (flaw, 0.0, 0.0)))
    bench.all_well(2.0)
    assert bench.system.situation(2.0)[0].state.position_std_m == 0.1
    assert bench.counts["accuracy: not told, or no number"] == 1
