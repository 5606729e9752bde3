"""Modes of second-order systems: undamped and damped, tracked along a path, and what moves their frequencies."""

from twin.modal.contributions import damping_contributions as damping_contributions
from twin.modal.damped import DampedModes as DampedModes
from twin.modal.damped import damped_modes as damped_modes
from twin.modal.elasticities import Elasticities as Elasticities
from twin.modal.elasticities import elasticities as elasticities
from twin.modal.reference import ReferenceModes as ReferenceModes
from twin.modal.reference import reference_modes as reference_modes
from twin.modal.tracking import likeness as likeness
from twin.modal.tracking import track as track
from twin.modal.undamped import Modes as Modes
from twin.modal.undamped import modes as modes
