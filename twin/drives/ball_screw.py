"""A ball screw axis: motor, coupling, screw, nut and slide as bodies joined by springs and dampers."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, is_concrete, positive
from twin.drives.ball_screw_state import BallScrewState
from twin.drives.dc_motor import DcMotor
from twin.drives.friction_slope import friction_slope
from twin.drives.inputs import DriveInputs, no_inputs
from twin.drives.rigid_screw_axis import RigidScrewAxis
from twin.drives.screw_damping import AbstractScrewDamping
from twin.drives.screw_matrices import ScrewMatrices, spring_matrix
from twin.drives.screw_outputs import ScrewAxisOutputs, screw_outputs
from twin.drives.screw_springs import PerSpring, ScrewSprings
from twin.drives.screw_travel import check_lead, travel_per_radian
from twin.laws import AbstractFriction
from twin.linear import SecondOrder
from twin.plant import AbstractPlant


class BallScrewAxis(AbstractPlant):
    """M·Ẍ + B·Ẋ + K·X = F for X = (θ₁, θ₂, θ₃, x₀, x₂, x₃), behind the electrics of the motor.

    The axis is free to move: K is singular, with one rigid-body mode. Its stiffness depends on where the nut is on the
    screw. The equations of motion come from the energies, so that the pull with which a loaded screw acts along the
    travel is included (F₀²/(2·E·A) and T₂₃²/(2·G·I_p), well below a newton in practice): without damping, energy is
    kept exactly. A nut that leaves the screw, l = nut_position + x₃ outside 0 to the screw's length, gives NaN: the run
    is marked as failed.

    The paper's eq. 14 prints k12 for the spring between nut and slide; its matrix 18 has k23, which is followed. It
    writes J_END in eq. 4 and J_EJ in matrix 18 for the same body.

    Raises:
        InputError: a mass, inertia or distance that is not positive and finite, a lead of zero, a nut beyond the screw.

    Source: Mauro, Pastorelli, Mohtar (2014), eq. 1 to 18.
    """

    motor: DcMotor
    """Electrics of the motor; its voltage is the command."""
    motor_inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Rotor and half of the coupling J_M [kg m²]."""
    end_inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """End of the screw and half of the coupling J_END [kg m²]."""
    screw_inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Screw J_BS [kg m²]."""
    screw_mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Screw m_BS [kg]."""
    nut_mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Nut m_BN [kg]."""
    slide_mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Slide m_S [kg]."""
    lead: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Lead of the screw p: travel per turn [m]; negative for a left-hand screw."""
    springs: ScrewSprings
    """Stiffness of the parts."""
    damping: AbstractScrewDamping
    """Damping of the springs."""
    friction: AbstractFriction
    """Friction torque between screw and nut, of the speed of the screw T_f [Nm]."""
    nut_position: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Distance of the nut from the fixed bearing at mid-stroke, where x₃ = 0 [m]."""
    follow_nut: bool = eqx.field(static=True, default=True)
    """Whether the stiffness follows the nut along its travel, or stays that at mid-stroke."""

    def __check_init__(self):
        for name in ("motor_inertia", "end_inertia", "screw_inertia"):
            positive(f"{name} of the ball screw axis", getattr(self, name), "kg m²")
        for name in ("screw_mass", "nut_mass", "slide_mass"):
            positive(f"{name} of the ball screw axis", getattr(self, name), "kg")
        check_lead(self.lead)
        positive("nut_position of the ball screw axis", self.nut_position, "m")
        if isinstance(self.springs, ScrewSprings):
            _check_nut(self.nut_position, self.springs.screw.length)

    @property
    def travel_per_radian(self) -> Float[Array, ""]:
        """Travel of the nut per angle of the screw h = p/2π [m/rad]."""
        return travel_per_radian(self.lead)

    def initial_state(self) -> BallScrewState:
        o = jnp.zeros(())
        return BallScrewState(o, o, o, o, o, o, o, o, o, o, o, o, o, self.friction.initial_state())

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> BallScrewState:
        s, h, screw = state, self.travel_per_radian, self.springs.screw
        k = self.springs.in_series(self.nut_position + (s.slide_displacement if self.follow_nut else 0.0))
        b = self.damping.coefficients(k)
        torsion = k.torsion * (s.end_angle - s.screw_angle)
        stretch = k.support * s.screw_displacement
        nut = s.screw_displacement + h * s.screw_angle - s.nut_displacement  # eq. 10
        nut_rate = s.screw_velocity + h * s.screw_speed - s.nut_velocity

        t12 = k.shaft * (s.motor_angle - s.end_angle) + b.shaft * (s.motor_speed - s.end_speed)
        t23 = torsion + b.torsion * (s.end_speed - s.screw_speed)
        f0 = stretch + b.support * s.screw_velocity
        fu = k.nut * nut + b.nut * nut_rate  # eq. 12
        f23 = k.flange * (s.nut_displacement - s.slide_displacement) + b.flange * (s.nut_velocity - s.slide_velocity)
        pull = 0.5 * (stretch**2 / screw.axial_rigidity + torsion**2 / screw.torsional_rigidity)
        pull = pull if self.follow_nut else 0.0
        friction = self.friction.force(s.friction, s.screw_speed, s.screw_angle)
        return BallScrewState(
            s.motor_speed,
            s.end_speed,
            s.screw_speed,
            s.screw_velocity,
            s.nut_velocity,
            s.slide_velocity,
            (self.motor.torque(s.current) - t12) / self.motor_inertia,  # eq. 2
            (t12 - t23) / self.end_inertia,  # eq. 4
            (t23 - h * fu - friction) / self.screw_inertia,  # eq. 6, 7
            (-f0 - fu) / self.screw_mass,  # eq. 8
            (fu - f23) / self.nut_mass,  # eq. 13
            (f23 + pull + inputs.load) / self.slide_mass,  # eq. 14
            self.motor.current_rate(inputs.command, s.current, s.motor_speed),  # eq. 1
            self.friction.rate(s.friction, s.screw_speed),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> ScrewAxisOutputs:
        return screw_outputs(
            self.motor,
            state.slide_displacement,
            state.slide_velocity,
            state.motor_angle,
            state.motor_speed,
            state.current,
            inputs.command,
        )

    def stiffness(self, nut_position: Float[ArrayLike, ""] | None = None) -> PerSpring:
        """Stiffness of the five springs, two [Nm/rad], three [N/m].

        Args:
            nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.

        Raises:
            InputError: a nut outside the screw.
        """
        if nut_position is None:
            return self.springs.in_series(self.nut_position)
        positive("nut_position", nut_position, "m")
        _check_nut(nut_position, self.springs.screw.length)
        return self.springs.in_series(jnp.asarray(nut_position, dtype=jnp.float64))

    def matrices(
        self, nut_position: Float[ArrayLike, ""] | None = None, *, stiffness: PerSpring | None = None
    ) -> ScrewMatrices:
        """M, K and B of eq. 18.

        Args:
            nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.
            stiffness: of the five springs, instead of that at the nut's position, as for varying one of them.

        Raises:
            InputError: a nut outside the screw.
        """
        k = self.stiffness(nut_position) if stiffness is None else stiffness
        h = self.travel_per_radian
        bodies = (self.motor_inertia, self.end_inertia, self.screw_inertia)
        bodies += (self.screw_mass, self.nut_mass, self.slide_mass)
        return ScrewMatrices(
            jnp.diag(jnp.stack(bodies)), spring_matrix(k, h), spring_matrix(self.damping.coefficients(k), h)
        )

    def second_order(
        self,
        nut_position: Float[ArrayLike, ""] | None = None,
        *,
        stiffness: PerSpring | None = None,
        friction_speed: Float[ArrayLike, ""] | None = None,
    ) -> SecondOrder:
        """The mechanics as M·ẍ + C·ẋ + K·x = B·u.

        Args:
            nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.
            stiffness: of the five springs, instead of that at the nut's position.
            friction_speed: speed of the screw at which the slope of the friction joins the damping [rad/s]; without
                friction, as in eq. 18, if not given.

        Returns:
            Inputs `torque` of the motor [Nm] and `load` on the slide [N]; outputs the six displacements, named as in
            the state, the slide's `position`.

        Raises:
            InputError: a nut outside the screw, friction with memory: use `linearise`.
        """
        mass, k, b = self.matrices(nut_position, stiffness=stiffness)
        if friction_speed is not None:
            b = b.at[2, 2].add(friction_slope("friction", self.friction, friction_speed))
        return SecondOrder(
            mass=mass,
            viscous=b,
            hysteretic=jnp.zeros((6, 6)),
            stiffness=k,
            input_map=jnp.eye(6)[:, np.array([0, 5])],
            output_map=jnp.eye(6),
            inputs=("torque", "load"),
            outputs=(*BallScrewState._fields[:5], "position"),
        )

    def rigid(self) -> RigidScrewAxis:
        """The same axis without elasticity: J = J_M + J_END + J_BS + h²·(m_BN + m_S)."""
        rotating = self.motor_inertia + self.end_inertia + self.screw_inertia
        inertia = rotating + self.travel_per_radian**2 * (self.nut_mass + self.slide_mass)
        return RigidScrewAxis(self.motor, inertia, self.lead, self.friction)


def _check_nut(position: ArrayLike, length: ArrayLike) -> None:
    if not all(isinstance(x, jax.Array | np.ndarray | float | int) and is_concrete(x) for x in (position, length)):
        return
    if np.any(np.asarray(position) > np.asarray(length)):
        raise InputError(
            f"nut_position must lie on the screw, between 0 and its length of {np.asarray(length):g} m, but is "
            f"{np.asarray(position)} m. It is the nut's distance from the fixed bearing."
        )
