"""What faults cost in safety: worlds of balls and conflicts with traffic, flown as faults grow.

A study is one fault at growing levels; every level flies the same worlds, so that differences are
the fault's. Worlds are distinguished by their seed alone: any number of processes gives the same.
"""

from clearway.studies.faults.flights import FaultFlight, Point, fly_one, fly_studies
from clearway.studies.faults.studies import ESCAPE, ESCAPES, STUDIES, FaultStudy, case

__all__ = [
    "ESCAPE",
    "ESCAPES",
    "STUDIES",
    "FaultFlight",
    "FaultStudy",
    "Point",
    "case",
    "fly_one",
    "fly_studies",
]
