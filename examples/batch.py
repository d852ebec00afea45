import pandas as pd

import clearway as cw

FLIGHTS, SHOWN = 100, ["safe", "time_s", "min_obstacle_distance_m", "emergencies"]
mission = cw.read_mission("static-obstacles")
winds = [(0.0, 0.3 * number / FLIGHTS, 0.0) for number in range(FLIGHTS)]
changed = [mission.with_values("simulation", seed=n, wind_mps=wind) for n, wind in enumerate(winds)]
flights = pd.DataFrame([cw.fly(one).to_row() for one in changed]).assign(wind_mps=winds)
print(flights[SHOWN].describe(include="all"))
