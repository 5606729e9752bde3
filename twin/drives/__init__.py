"""Plants: one drive per file."""

from twin.drives.inputs import DriveInputs as DriveInputs
from twin.drives.servo_axis import ServoAxis as ServoAxis
from twin.drives.servo_axis import ServoAxisOutputs as ServoAxisOutputs
from twin.drives.servo_axis import ServoAxisState as ServoAxisState
from twin.drives.two_mass import TwoMass as TwoMass
from twin.drives.two_mass import TwoMassOutputs as TwoMassOutputs
from twin.drives.two_mass import TwoMassState as TwoMassState
from twin.drives.two_mass_modes import TwoMassModes as TwoMassModes
from twin.drives.two_mass_modes import two_mass_modes as two_mass_modes
