"""All tolerances and limits of the engine, each with its scale or unit.

They are written here once; :mod:`prbm.kernel.header` generates the constants of the C kernel from
this module.  The end of a name is the kind of the number: ``RTOL`` a fraction of the scale that the
comment names, ``ATOL`` a number with a unit, ``MAX`` and ``MIN`` a limit, ``FACTOR`` a factor.
:class:`prbm.hybrid.configuration.Scales` turns fractions into numbers with units.
"""

import math

# --- description -------------------------------------------------------------------------------
JOINT_DISTANCE_RTOL = 1e-9  # Of the size: largest distance of two points that a joint connects.
INERTIA_RATIO_MIN = (
    1e-12  # Of the largest inertia of a coordinate: the motion of a body with less is round-off.
)
FLEXURE_INERTIA_RATIO_MIN = 1e-16  # The same for a flexure, whose springs are weak, too.
DEPENDENT_LOOP_RTOL = 1e-9  # Of the loop Jacobian's largest entry: smaller pivots are round-off.
STUB_RTOL = 1e-12  # Of a cantilever's length: excess of the sum of its links that is round-off.

# --- constraints -------------------------------------------------------------------------------
SINGULAR_RTOL = 1e-12  # Of the largest pivot of a scaled matrix: a smaller one is round-off.
ROW_RTOL = 1e-9  # Of the size: a constraint whose row is shorter does not depend on the position.
CONSTRAINT_RTOL = 1e-14  # Of the size: residual of a closed loop, a few roundings of a coordinate.
CONSTRAINT_STALLED_RTOL = 1e-12  # Of the size: residual accepted when iteration stops improving.
CONSTRAINT_ITERATIONS_MAX = 20  # Gauss-Newton converges quadratically; three are usual.
PROJECTION_FACTOR = 1.0  # Of the square root of the tolerance: largest change by a projection.

# --- statics and modes -------------------------------------------------------------------------
STATICS_ITERATIONS_MAX = 30  # Newton steps at one load.
STATICS_TURN_MAX = 0.5  # rad per Newton step and load step; a larger turn reaches another shape.
STATICS_TURN_AIM = 0.45  # rad per load step, at which the control of load steps aims.
STATICS_CLOSE_SHARE = 0.1  # Of these turns, if a path is followed closely.
STATICS_TURN_MIN = 1e-300  # rad; avoids a division by zero.
STATICS_LOAD_STEP_MIN = 2**-14  # Of the load: smallest continuation step.
STATICS_LOAD_STEPS_MAX = 2000  # With rejected ones; a path that crawls through slack ends.
STATICS_HINT_SHARE = 1 / 128  # Of the load: if less is carried, pins may turn freely.
STATICS_LIMP_RATIO = (
    1e3  # Of the stiffest spring at one radian: a unit may be wrong if weight is more.
)
STATICS_SHRINK_MIN = 0.25  # Smallest ratio of a load step to the one before.
STATICS_SHRINK = 0.5  # Ratio of a load step to one without an equilibrium.
STATICS_GROWTH_MAX = 2.0  # Largest ratio of a load step to an accepted one before.
STATICS_CONSTRAINT_RTOL = 1e-13  # Of the size: residual of closed loops at an equilibrium.
STIFFNESS_ROUNDING_RTOL = 1e-12  # Of the largest stiffness or scale of energies: less is round-off.
STATICS_FORCE_RTOL = 1e-12  # Of the stiffest spring at one radian: residual torque.
STATICS_ROUNDING_RTOL = 1e-13  # Of the torques that are added: residual torque of round-off.
REPEATED_MODE_RTOL = 1e-11  # Of the largest square of a frequency: less between two is round-off.
STATICS_STEP_ATOL = 1e-8  # rad; Newton step that ends the iteration: the error is its square.
RIGID_RTOL = 1e-12  # Of the largest compliance of a body: a smaller one is round-off.
START_RTOL = 1e-6  # Of the size, of one radian, of the largest rate: deviation of a start value.
START_DEPENDENT_RTOL = 1e-9  # Of a free body's mobility: a start value that follows from others.
RELEASE_LEVER_RTOL = 0.02  # Of the size: a body turns about a point with a shorter lever.
RELEASE_MODE_RTOL = 1e-6  # Of the size times the largest turn: no motion of a point by a mode.
ZERO_FREQUENCY_RTOL = 1e-7  # Of the highest frequency: a lower frequency is round-off.
ZERO_MODE_RTOL = 1e-12  # Of the momenta before and after: a smaller modal momentum is round-off.
SPRINGLESS_RATE = 2 * math.pi  # rad/s: rate scale without springs, gravity and initial velocity.

# --- impacts -----------------------------------------------------------------------------------
COMPLEMENTARITY_RTOL = 1e-10  # Of the largest approach speed: allowed violation.
PIVOT_RTOL = 1e-11  # Of the largest entry of its column: a smaller pivot is round-off.
RATIO_RTOL = 1e-12  # Of the largest constant: ratios this close are equal.
LIMIT_RTOL = 1e-11  # Of the limits of friction: forces of contacts at rest have these errors.
ROTATION_SWEEPS_MAX = 60  # Sweeps of Jacobi's method; about six are usual.
PIVOTS_FACTOR = 50  # Pivots of a complementarity problem, for each of its unknowns.
COVER_FACTOR = 32.0  # Weight of one normal force in the covering vector of a second path.
MODES_TRIED_MAX = 2000  # Combinations of contact modes that are tried if all paths fail.
SIDES_TRIED_MAX = 64  # Combinations of sides of guides that are tried if single changes fail.
WEDGED_RTOL = 1e-10  # Of the inverse normal mass: a smaller rate of the approach is round-off.
ZERO_SPEED_RTOL = 1e-12  # Of the speeds at that time: round-off of a vanished speed.
IMPULSE_RANK_RTOL = 1e-13  # Of the largest singular value: rank of the inverse mass in contact.
REACTION_RANK_RTOL = 1e-12  # Of the largest singular value: rank of the rows of held stops.
REBOUND_RTOL = 1e-12  # Interval of s, the share of restitution, at which bisection ends.

# --- contact modes -----------------------------------------------------------------------------
TOUCHING_RTOL = 1e-10  # Of the size: stops with smaller gaps join an impact at another stop.
RELEASE_PENETRATION_RTOL = 1e-8  # Of the size: largest penetration of a wall at release.
MODE_ITERATIONS_MAX = 10  # Choices of the modes of contacts and projections; two are usual.
VANISHED_BOUNCE_RTOL = 1e-12  # Of the size: the height of a lower bounce is round-off.
DEPENDENT_FRICTION_RTOL = 1e-4  # Of a contact's free mobility: if less, others carry its load.
ZERO_RATE_RTOL = 1e-9  # Of the velocity scale: a slower rate is round-off.
FRICTION_EXCESS_RTOL = 1e-6  # Of the friction limit: excess at which a sticking contact slips.
EVENTS_MAX = 1000  # Events within EVENT_WINDOW_RTOL that end a simulation.
EVENT_WINDOW_RTOL = 5e-3  # Of the period: time span in which events are counted.
WALL_PATH_RTOL = 1e-13  # Of the size: a smaller change of a wall's reference is round-off.
WALL_FADING_FACTOR = 1 / 3  # Of each communication step: reduction of the remembered longest step.
WALL_LONGEST_RTOL = 0.1  # Of the period: longest communication step that walls remember.
WALL_STEP_RTOL = 0.5  # Of the time in which a wall joins its reference: longest integration step.
REST_SPEED_RTOL = 1e-3  # Of a typical closing speed: default speed below which impacts end in rest.
REST_AMPLITUDE_RTOL = 1e-2  # Of the size: amplitude at a stop that touches a mechanism at rest.
REST_SPEED_MIN_FACTOR = 20.0  # Of the zero speed: smaller jumps of a wall's rate open no stop.
WALL_MOBILITY_MAX = 1e100  # 1/kg; larger mobilities lose impulses to underflow.
EVENTS_AT_ONCE_MAX = 16  # Events of one contact at one time in model exchange.
IMPACT_COUNT_MAX = 2147483647  # Largest Integer of FMI.

# --- springs -----------------------------------------------------------------------------------
SPRING_LENGTH_RTOL = 1e-9  # Of the size: length of a spring whose ends coincide.
SPRING_APART_RTOL = 1e-6  # Of the size: smallest distance of the ends of a spring as drawn.
SPRING_FREE_RTOL = 1e-12  # Of the length as drawn: a spring that is shorter by less still acts.
SPRING_IDLE_RTOL = 1e-9  # Of the stiffest: that of a body on springs in directions without any.

# --- compliant stops ---------------------------------------------------------------------------
DAMPING_ELASTIC_MIN = 0.9999  # Restitution above which the first term of a series is exact.
DAMPING_PLASTIC_MAX = 0.03  # Restitution below which the factor of the damping is 1/e.
DAMPING_BISECTIONS = 60  # Bisections of the factor of the damping.
PHASE_RTOL = 1e-9  # Of the elastic force: excess of the damping at which a contact switches.
REFERENCE_SPEED_RTOL = 1e-6  # Of the reference speed: excess of the rate at which it rises.
FIRST_RISE_MAX = 1e-3  # Of the reference speed: rise after first touch that is not integrated.
FROZEN_FORCE_RTOL = 1e-2  # Of the elastic force: difference at which a frozen stop is released.
FREEZING_FACTOR = 0.5  # Of FROZEN_FORCE_RTOL: largest difference of a contact that freezes.
TOUCH_STEP_FACTOR = 0.4  # Of the depth of a free hit over its speed: first step of a contact.
TOUCH_STEP_CURVED_FACTOR = 0.05  # The same if the exponent is above 1: F is not smooth at d = 0.
CONTACT_ERROR_FACTOR = 100.0  # Of the allowed error of a step: that of indentation and its rate.
INDENTATION_MIN_RTOL = 1e-7  # Of the size: smallest scale of the error of an indentation.
PEAK_REFINEMENTS = 3  # Parabolas through ever closer points at a peak.
PEAK_REACH_FACTOR = 1.5  # Of half a step, from its middle: no peak if the vertex is further away.
PEAK_REFINEMENT_FACTOR = 0.125  # Ratio of the distances of these points.

# --- location of events ------------------------------------------------------------------------
EVENT_TIME_RTOL = 5e-12  # Of the step: tolerance of the search for the time of an event.
EVENT_TIME_FACTOR = 2.0  # Of this tolerance: error of the time of an event.
EVENT_TIME_ULPS = 8.0  # Of the spacing of floating-point numbers at the time: further error of it.
RELEASE_WATCH_FACTOR = 0.5  # Of the largest stop force in a step: a lower force starts a search.
LOCATION_ITERATIONS_MAX = 100  # Iterations of Brent's search; about ten are usual.
GUARD_INTERVALS = 8  # Intervals of a step in which the guards are evaluated.

REVERSAL_DELAY_RTOL = 1e-3  # Of the step: delay of a reversal where the motion is not unique.
EVENT_CORRECTIONS_MAX = 3  # Newton steps of a closing gap on projected states.
EVENT_CORRECTION_RTOL = 1e-2  # Of the step: a larger correction indicates grazing; not applied.

# --- step size ---------------------------------------------------------------------------------
TOLERANCE_MIN = 1e-13  # Smallest relative tolerance of the integration.
TOLERANCE_MAX = 1e-2  # Largest relative tolerance that is accepted.
TOLERANCE_USED_MAX = 1e-5  # Largest one that is used: looser ones lose energy without notice.
TABLEAU_ATOL = 1e-14  # Error of a sum of Runge-Kutta coefficients that is round-off.
STEP_SAFETY_FACTOR = 0.85  # Of the optimal step size.
STEP_SHRINK_MIN = 0.2  # Smallest ratio of successive step sizes.
STEP_GROWTH_MAX = 5.0  # Largest ratio of successive step sizes.
STEP_MEMORY_EXPONENT = 0.04  # Exponent of the previous error in the step size [Hairer, IV.2].
STEP_TREND_FACTOR = 0.75  # Of STEP_MEMORY_EXPONENT: reduction of the exponent of the last error.
STEP_ERROR_FACTOR = 2.0  # Of the tolerance: error of a step that is accepted.
STEP_ROUNDING_FACTOR = 2.0**49 + 1.0  # Rounds a step size to 4 binary digits [Dekker, 1971].
STABLE_STEP_FACTOR = 4.0  # Of the inverse rate of the fastest mode: longest step; 4.4 is stable.
STABLE_STEP_WATCH_FACTOR = 0.25  # Of the longest stable step: above, that mode is refined.
FASTEST_RATE_RTOL = 1e-3  # Change of the rate of the fastest mode at which iteration ends.
FASTEST_ITERATIONS_MAX = 100  # At the start of the motion; about ten are usual.
STEP_ERROR_MIN = 1e-4  # Of the tolerance: smallest error that the controller remembers.
STEP_MAX_RTOL = 0.08  # Of the period: longest step.
NODE_STEP_RTOL = 1e-5  # Of the period: shorter steps are interpolated by their stages only.
DENSE_FACTOR = 1.0  # Of the tolerance: embedded error up to which the dense output is used.
INTERPOLATION_FACTOR = 10.0  # Of the tolerance: largest difference of two interpolations.
NODE_RATIO_MIN = 1 / 6  # Of a step: shortest previous step whose start is a node.
STEP_MIN_RTOL = 1e-20  # Of the period: shortest step.
LATE_TIME_RTOL = 1e-9  # Of the period: spacing of floating-point times that shortens steps.
FIRST_STEP_FACTOR = 0.1  # Of the first step that the tolerance allows [Hairer, II.4].
FIRST_STEP_MIN_RTOL = 5e-10  # Of the period: shortest first step; soft springs have small scales.
FIRST_STEP_EXPONENT = 1 / 6  # Exponent of the tolerance in the first step size.
STEPS_MAX = 1e9  # Longest steps to one target time; more are a mistake of units.

DEFAULT_EFFORT_MAX = 1000.0  # Integration steps in a step of the default experiment.
EFFORT_MAX = 1000000  # Integration steps from one communication point to the next.
BURST_STEPS_MAX = 10000  # Integration steps within EVENT_WINDOW_RTOL, besides the following.
FASTEST_STEPS_FACTOR = 2.0  # Of the stable steps of the fastest mode: steps that are accepted.

# --- communication times -----------------------------------------------------------------------
TIME_SUM_RTOL = 1e-12  # Of a time: round-off of importers that add up steps.
STEP_SUM_RTOL = 1e-6  # Of a communication step: round-off that an importer's time accumulates.
STOP_TIME_RTOL = 1e-3  # Of a communication step: allowed overshoot of the stop time.

# --- model exchange ----------------------------------------------------------------------------
NOMINAL_ANGLE_MIN = 1e-2  # rad; smallest amplitude from which nominal values of states are derived.
NOMINAL_STRAIN_FACTOR = 0.1  # Of the energy at the start: assumed in the stiffest axial spring.
TURN_RTOL = 1e-7  # Of the reference speed: rate after an extremum of a contact at its event.
DIFFERENCE_RTOL = 1e-5  # Of a parameter: step of the derivative with respect to it.
DIFFERENCE_ATOL = 1e-7  # In the unit of a parameter that is zero: the same.
DRIFT_RTOL = 1e-7  # Of the size: drift of a held contact that requests an event.
DRIFT_SPEED_FACTOR = 10.0  # Of DRIFT_RTOL: the same for speeds, which solvers keep less exactly.
MOVING_DRIFT_FACTOR = 10.0  # Of DRIFT_RTOL: the same while the wall moves.
SLIDING_ERROR_RTOL = 1e-8  # Of the speed: sliding at the end of sliding that is a solver's error.
DRIFT_CORRECTED_RTOL = 1e-12  # Of the size: drift that an event leaves uncorrected.
PENETRATION_WARNING_RTOL = 1e-2  # Of the size: a larger penetration is logged as a warning.
REST_JUMP_FACTOR = 0.5  # Of the largest jump that opens no stop: gap rate that needs an event.
SLIDING_ENDS_FACTOR = 0.5  # Of the zero speed: sliding ends at a lower speed.
GAP_CLOSED_RTOL = 1e-12  # Of the size: depth below zero at which a gap closes.
LOWEST_BOUNCE_RTOL = 1e-10  # Of the size: height of the lowest bounce that is resolved in time.
INDICATOR_LEAD_RTOL = 0.01  # Of the period: time that multiplies an opening rate in an indicator.
DEPENDENT_PIVOT_RTOL = 1e-7  # Of the largest pivot: smaller pivots make the states singular.

# --- beams ---

NOTCH_LENGTH_RTOL = 1e-9  # Of the length of a flexure: excess of its notch that is round-off.
NOTCH_PEAK_FACTOR = 0.7  # Of the distance of the poles: width of the peak where nodes are dense.
FINE_POINTS = 8  # Gauss points between two nodes, for the integrals of the flexibility.
GAUSS_ITERATIONS_MAX = 8  # The nodes of Gauss' quadrature need four iterations of Newton's method.

# --- stress ---

WAIST_ATOL = 1e-12  # Of half a panel: a point that is nearer to a waist is at the waist.
CONCENTRATION_SERIES_MAX = 1e-6  # Of half the waist over the radius: the series has one term.
STRESS_TIE_RTOL = 1e-9  # Stresses of two sections that differ less are equal apart from round-off.
SUMMIT_SHARE_MIN = 0.8  # Of the largest stress in a section: stress at a node beside a larger one.
SUMMIT_NODES_MIN = 3  # Fewer nodes define no polynomial with a maximum between them.
SUMMIT_STEPS = 3  # Of Newton's method, from the zero of the secant of the slope.
