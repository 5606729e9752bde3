"""Position-dependent machines: components as free-interface modal models, joined by springs and dampers."""

from twin.structure.component import Component as Component
from twin.structure.connections import Connections as Connections
from twin.structure.directions import DIRECTIONS as DIRECTIONS
from twin.structure.directions import Directions as Directions
from twin.structure.import_modes import component_from_modes as component_from_modes
from twin.structure.import_modes import component_modes as component_modes
from twin.structure.joint import Attachment as Attachment
from twin.structure.joint import Joint as Joint
from twin.structure.lumped_mass import LumpedMass as LumpedMass
from twin.structure.machine import Machine as Machine
from twin.structure.rail import Rail as Rail
