"""Constitutive laws: friction as a function of speed, forces as a function of position."""

from twin.laws.asymmetric import AsymmetricFriction as AsymmetricFriction
from twin.laws.coulomb import CoulombFriction as CoulombFriction
from twin.laws.coulomb import CoulombViscousFriction as CoulombViscousFriction
from twin.laws.dahl import DahlFriction as DahlFriction
from twin.laws.dahl import DahlState as DahlState
from twin.laws.friction import AbstractFriction as AbstractFriction
from twin.laws.friction import AbstractStaticFriction as AbstractStaticFriction
from twin.laws.lugre import LuGreFriction as LuGreFriction
from twin.laws.lugre import LuGreState as LuGreState
from twin.laws.position_force import AbstractPositionForce as AbstractPositionForce
from twin.laws.position_force import ConstantForce as ConstantForce
from twin.laws.position_force import HarmonicForce as HarmonicForce
from twin.laws.position_force import NoForce as NoForce
from twin.laws.position_force import PolynomialForce as PolynomialForce
from twin.laws.position_force import SumForce as SumForce
from twin.laws.smooth import smooth_abs as smooth_abs
from twin.laws.smooth import smooth_power as smooth_power
from twin.laws.smooth import smooth_sign as smooth_sign
from twin.laws.stribeck import StribeckFriction as StribeckFriction
from twin.laws.stribeck import stribeck_level as stribeck_level
from twin.laws.sum import SumFriction as SumFriction
from twin.laws.tabulated import TabulatedFriction as TabulatedFriction
from twin.laws.viscous import ViscousFriction as ViscousFriction
