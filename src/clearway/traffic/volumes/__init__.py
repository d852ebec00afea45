"""Volumes that no two aircraft should share, and the alerts that tell how soon they would."""

from clearway.traffic.volumes.alerts import Alert, Alerts, alerts_after
from clearway.traffic.volumes.named import VOLUME_SETS
from clearway.traffic.volumes.volume import AirVolume, AlertLevel, AlertRule, VolumeSet

__all__ = [
    "VOLUME_SETS",
    "AirVolume",
    "Alert",
    "AlertLevel",
    "AlertRule",
    "Alerts",
    "VolumeSet",
    "alerts_after",
]
