"""What leaves the twin: linear systems, measured data files, compiled steps and FMUs for other tools."""

from twin.export.compiled_step import CompiledStep as CompiledStep
from twin.export.compiled_step import export_step as export_step
from twin.export.compiled_step import load_step as load_step
from twin.export.fmu import write_fmu as write_fmu
from twin.export.frf_csv import write_frf_csv as write_frf_csv
from twin.export.frf_uff import write_frf_uff as write_frf_uff
from twin.export.linear_system import from_control as from_control
from twin.export.linear_system import to_control as to_control
from twin.export.linear_system import to_scipy as to_scipy
from twin.export.names import state_names as state_names
from twin.export.trajectory import write_trajectory as write_trajectory
