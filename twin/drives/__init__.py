"""Plants: one drive per file."""

from twin.drives.against_stop import AgainstStop as AgainstStop
from twin.drives.driven_table import DrivenTable as DrivenTable
from twin.drives.driven_table import DrivenTableInputs as DrivenTableInputs
from twin.drives.driven_table import DrivenTableState as DrivenTableState
from twin.drives.driven_table import MotorMotion as MotorMotion
from twin.drives.inputs import DriveInputs as DriveInputs
from twin.drives.leipe import leipe_drive as leipe_drive
from twin.drives.rack_pinion import DriveTrain as DriveTrain
from twin.drives.rack_pinion import RackPinionDrive as RackPinionDrive
from twin.drives.rack_pinion import RackPinionInputs as RackPinionInputs
from twin.drives.rack_pinion import RackPinionOutputs as RackPinionOutputs
from twin.drives.rack_pinion import RackPinionState as RackPinionState
from twin.drives.rack_pinion import TorquePair as TorquePair
from twin.drives.servo_axis import ServoAxis as ServoAxis
from twin.drives.servo_axis import ServoAxisOutputs as ServoAxisOutputs
from twin.drives.servo_axis import ServoAxisState as ServoAxisState
from twin.drives.two_mass import TwoMass as TwoMass
from twin.drives.two_mass import TwoMassOutputs as TwoMassOutputs
from twin.drives.two_mass import TwoMassState as TwoMassState
from twin.drives.two_mass_modes import TwoMassModes as TwoMassModes
from twin.drives.two_mass_modes import two_mass_modes as two_mass_modes
