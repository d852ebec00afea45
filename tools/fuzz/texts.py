"""Whole files of text and JSON, as Python values."""

from __future__ import annotations

MISSIONS = (
    """[mission]
name = "short"
waypoints_m = [[4, 0, 0]]
[grid]
range_m = 6
layers = 3
columns = 4
rows = 3
[vehicle]
position_m = [0, 0, 0]
speed_mps = 1.0
[simulation]
seed = 1
time_limit_s = 3.0
[[lidar]]
beams_per_cell = [4, 3]
sigma_m = 0.02
[[obstacle]]
shape = "cuboid"
position_m = [3, 3, 0]
size_m = [1, 2, 3]
orientation_deg = [0, 0, 30]
""",
    """[mission]
name = "traffic"
waypoints_m = [[3, 0, 0], [3, 2, 0.5]]
reach_radius_m = 1.5
[simulation]
time_limit_s = 2
wind_mps = [0.1, 0, 0]
[safety]
margin_m = 0.6
[rating]
name = "visible"
[prices]
turn = 0.3
[[intruder]]
name = "crossing"
appears_s = 0
position_m = [12, 7, 0]
velocity_mps = [0, -0.8, 0.1]
spread_deg = [5, 5]
radius_m = 0.5
""",
)
SCENES = (
    """[grid]
range_m = 6
layers = 3
columns = 4
rows = 3
[vehicle]
position_m = [1, 2, 3]
attitude_deg = [0, 5, 30]
[[obstacle]]
shape = "ball"
name = "front"
position_m = [3, 0, 0]
radius_m = 1.0
[scan.simulate]
beams_per_cell = [4, 3]
sigma_m = 0.02
[[intruder]]
position_m = [6, 5, 0]
velocity_mps = [-1, -1, 0]
spread_deg = [5, 3]
radius_m = 0.3
timed = true
[reach_set]
method = "flying"
[rating]
unknown = 0.5
""",
)
CAMPAIGNS = (
    """[campaign]
name = "small"
planners = ["clearway", "straight"]
seeds = 1
[[family]]
family = "forest"
""",
)


SQUARE = [[[6.95, 50.94], [6.951, 50.94], [6.951, 50.941], [6.95, 50.941], [6.95, 50.94]]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {"height": 30, "name": "block"},
         "geometry": {"type": "Polygon", "coordinates": SQUARE}},
        {"type": "Feature", "properties": {"height": 120},
         "geometry": {"type": "Point", "coordinates": [6.953, 50.942]}},
        {"type": "Feature", "properties": {"height": 20},
         "geometry": {"type": "LineString", "coordinates": [[6.95, 50.94], [6.96, 50.945]]}},
    ],
}  # fmt: skip
CITY = {
    "type": "CityJSON", "version": "1.1",
    "transform": {"scale": [0.001, 0.001, 0.001], "translate": [84000.0, 447000.0, 0.0]},
    "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
    "CityObjects": {"house": {"type": "Building", "geometry": [
        {"type": "MultiSurface", "lod": "1.2", "boundaries": [[[0, 1, 2, 3]], [[4, 5, 6, 7]]]}]}},
    "vertices": [[0, 0, 0], [9000, 0, 0], [9000, 9000, 0], [0, 9000, 0],
                 [0, 0, 8000], [9000, 0, 8000], [9000, 9000, 8000], [0, 9000, 8000]],
}  # fmt: skip
OBSTACLES = (
    "name,latitude,longitude,height_m,elevation_m\nmast,50.94,6.95,120,50\ncrane,50.945,6.96,60,\n"
)
PLAN = {
    "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
    "geoFence": {"circles": [{"circle": {"center": [47.39, 8.54], "radius": 90}, "inclusion": True,
                              "version": 1}],
                 "polygons": [{"polygon": [[47.39, 8.54], [47.391, 8.54], [47.391, 8.541]],
                               "inclusion": False, "version": 1}], "version": 2},
    "mission": {"cruiseSpeed": 15, "hoverSpeed": 5, "firmwareType": 12, "vehicleType": 2,
                "plannedHomePosition": [47.3977, 8.5456, 488], "version": 2,
                "items": [{"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": True,
                           "doJumpId": 1, "params": [0, 0, 0, None, 47.3977, 8.5456, 20]},
                          {"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": True,
                           "doJumpId": 2, "params": [0, 0, 0, None, 47.3978, 8.5457, 20]}]},
    "rallyPoints": {"points": [], "version": 2},
}  # fmt: skip
WAYPOINTS = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t47.3977\t8.5456\t20\t1\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t47.3978\t8.5457\t20\t1\n"
)
JUMPS = (
    "# by hand\nQGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\n# a tag\n2\t0\t0\t600\t7\t0\t0\t0\t0\t0\t0\t1\n"
    "3\t0\t3\t16\t0\t0\t0\t0\t47.3978\t8.5457\t0\t1\n4\t0\t3\t19\t5\t0\t0\t0\t0\t0\t0\t1\n"
    "5\t0\t3\t177\t3\t2\t0\t0\t0\t0\t0\t1\n6\t0\t0\t601\t7\t-1\t0\t0\t0\t0\t0\t1\n"
    "7\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
)
LIMITS = (
    "QGC WPL 110\n" + "".join(
        f"{n}\t0\t0\t5001\t3\t0\t0\t0\t47.39{n}\t8.54{n * n}\t0\t1\n" for n in range(3)
    )
    + "3\t0\t0\t5004\t30\t0\t0\t0\t47.39\t8.54\t0\t1\n"
    + "4\t0\t3\t5100\t0\t0\t0\t0\t47.4\t8.5\t9\t1\n",
    "# saved\n47.39 8.54\n47.38 8.53\n47.38 8.55\n47.40 8.55\n47.38 8.53\n",
    "RALLY 47.39 8.54 40 0 0 0\n",
)  # fmt: skip
HEX = (
    "timestamp,frame\n1.0,8D40621D58C382D690C8AC2863A7\n2.0,8D40621D58C386435CC412692AD6\n"
    "3.0,8D485020994409940838175B284F\n"
)
AVR = "@0000000000018D40621D58C382D690C8AC2863A7;\n@000000B71B018D40621D58C386435CC412692AD6;\n"
SBS = "".join(
    f"MSG,3,1,1,40621D,1,2025/06/01,12:00:0{n}.000,2025/06/01,12:00:0{n}.000,,3000,,,50.94{n},"
    "6.95,,,0,0,0,0\n"
    for n in range(8)
)
AIRCRAFT = {
    "now": 1748779200.0, "messages": 5,
    "aircraft": [{"hex": "40621d", "flight": "ABC123  ", "alt_baro": 3000, "alt_geom": 3100,
                  "gs": 120, "track": 90, "baro_rate": 64, "lat": 50.94, "lon": 6.95, "seen_pos": 1,
                  "seen": 0.5, "type": "adsb_icao"},
                 {"hex": "40621e", "alt_baro": "ground", "lat": 50.941, "lon": 6.951, "seen": 0}],
}  # fmt: skip
TRACE = {
    "icao": "40621d", "r": "G-ABCD", "timestamp": 1748779200.0,
    "trace": [[float(n), 50.94 + n / 1e3, 6.95, 3000 + n, 120.0, 90.0, 0, 64,
               {"flight": "ABC123", "alt_geom": 3100}, "adsb_icao", 3100, 64, 120, 0]
              for n in range(5)],
}  # fmt: skip
STATES = {
    "time": 1748779200,
    "states": [["40621d", "ABC123  ", "UK", 1748779199, 1748779199, 6.95 + n / 1e3, 50.94, 900.0,
                False, 60.0, 90.0, 0.3, None, 930.0, "1000", False, 0] for n in range(3)],
}  # fmt: skip
TRAJECTORIES = [
    {"timestamp": 1748779200000 + 1000 * n, "icao24": icao, "callsign": "ABC", "altitude": 3000,
     "latitude": 50.94 + n / 1e3, "longitude": 6.95, "groundspeed": 120, "track": 0,
     "vertical_rate": 0}
    for icao in ("40621d", "40621e") for n in range(4)
]  # fmt: skip
STATES_CSV = "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,baroaltitude\n" + (
    "1748779200,40621d,50.94,6.95,60,90,0,ABC,False,900\n"
    "1748779201,40621d,50.941,6.95,60,90,0,ABC,False,900\n"
)
DAA = (
    "NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]\n"
    "Ownship 50.94 6.95 3000 100 0 0 0\nIntruder 50.95 6.95 3000 -100 0 0 0\n"
    "Ownship 50.94 6.951 3000 100 0 0 1\nIntruder 50.95 6.949 3000 -100 0 0 1\n"
)
SCN = (
    "00:00:00.00>CRE KL001 B744 50.94 6.95 90 FL100 250\n00:00:00.00>CRE KL002 A320 50.95 6.96 270 "
    "3000 200\n00:00:01.00>HDG KL001 100\n"
)
POSE_TEXTS = (
    "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n",
    "0.0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n",
    "time,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n0.1,1,0,0,0,1,2\n",
    "timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n0,1,2,3,1,0,0,0\n",
)
