"""Encounter models: Bayes networks of how aircraft fly, read from their files and sampled."""

from clearway.studies.encounter_model.model_file import make_up_model, read_encounter_model
from clearway.studies.encounter_model.network import EncounterModel, Node, Variable
from clearway.studies.encounter_model.sample import (
    SampledTracks,
    sample_initial,
    sample_tracks,
    step_bins,
    values_of,
)

__all__ = [
    "EncounterModel",
    "Node",
    "SampledTracks",
    "Variable",
    "make_up_model",
    "read_encounter_model",
    "sample_initial",
    "sample_tracks",
    "step_bins",
    "values_of",
]
