"""How much two sets of modes, or two sets of frequency responses, are alike; and which modes belong together."""

from twin.correlation.modal_parameters import eigenvalue as eigenvalue
from twin.correlation.modal_parameters import ndd as ndd
from twin.correlation.modal_parameters import ndd_squared as ndd_squared
from twin.correlation.modal_parameters import nfd as nfd
from twin.correlation.modes import macxp_of_modes as macxp_of_modes
from twin.correlation.pairing import PairedModes as PairedModes
from twin.correlation.pairing import assign as assign
from twin.correlation.pairing import pair_modes as pair_modes
from twin.correlation.responses import csf as csf
from twin.correlation.responses import frac as frac
from twin.correlation.shapes import mac as mac
from twin.correlation.shapes import macxp as macxp
