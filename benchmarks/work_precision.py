"""Comparison of explicit Runge-Kutta pairs: error over right-hand sides, and observed orders.

    python benchmarks/work_precision.py --out build
    python benchmarks/work_precision.py --orders

Work: a smooth arc of the default 1R and 2R, from just after the first impact (0.043 s) to
0.1 s, at tolerances 1e-3 to 1e-13.  All pairs use the same loop, the same step size control
(here without a largest step) and the same projection after each step.

- The work is the number of right-hand sides of accepted and rejected steps, and of the dense
  output on every step, because events are searched on every step.
- The error at a time is the root mean square over the state in the scales of the engine.  The
  result is the largest error over 201 times at which the dense output is evaluated.
- The reference is SciPy's DOP853 at 1e-13, restarted at each of these times.

Orders: fixed steps, on smooth arcs and across an impact that is located on the dense output.  The
order is the slope of a least-squares line through the logarithms of the errors of four step sizes
(three halvings).  It is computed for two sequences of step sizes per octave, which takes minutes.

All coefficients are checked against the order conditions before use.

Sources
-------
.. [1] J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19; interpolant of order 4:
   L. F. Shampine, Math. Comp. 46 (1986) 135.
.. [2] Ch. Tsitouras, Comput. Math. Appl. 62 (2011) 770.
.. [3] P. Bogacki, L. F. Shampine, Comput. Math. Appl. 32 (1996) 15; three further stages for an
   interpolant of order 5 from RKSUITE (R. W. Brankin, I. Gladwell, L. F. Shampine, 1991).
.. [4] J. H. Verner, Numer. Algorithms 53 (2010) 383, and the coefficients of his "most
   efficient" 6(5) pair; an interpolant of order 5 with one further stage, of order 6 with three.
.. [5] P. Bogacki, L. F. Shampine, Appl. Math. Lett. 2 (1989) 321.
.. [6] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.5, II.6
   (DOP853; its coefficients are SciPy's); rooted trees and order conditions: II.2.
.. [7] Ch. Tsitouras, S. N. Papakostas, SIAM J. Sci. Comput. 20 (1999) 2067: the pair NEW7(5) of the
   engine, with an interpolant of order 5 that needs no further stage.
"""

import argparse
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from prbm import load
from prbm.base.errors import SimulationError
from prbm.hybrid.runge_kutta import TSITOURAS_PAPAKOSTAS as ENGINE
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import contact
from prbm.mechanics.contact_problem import ContactProblem

mpl.use("Agg")
import matplotlib.pyplot as plt

Real = NDArray[np.float64]
Tree = tuple["Tree", ...]

MODELS = {"1R": "PRBDM", "2R": "PRBDM2R"}
ARC = (0.043, 0.1)  # Interval of the default runs without an impact [s].
TOLERANCES = 10.0 ** -np.arange(3.0, 13.25, 0.5)
TARGETS = (1e-4, 1e-6, 1e-8, 1e-10)
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0  # Step size control of the engine.
SIZES_PER_SLOPE = 4  # Step sizes for one slope: three halvings.
OCTAVE = 2  # Sequences of step sizes per octave.


# -- pairs --


@dataclass(frozen=True)
class Pair:
    """An embedded pair with its dense output.

    Parameters
    ----------
    name : str
        Name in the tables.
    order : int
        Order of the solution that is continued.
    dense_order : int
        Order of the interpolant.
    last : int
        Stage whose row contains the weights; it is the first stage of the next step.  Later stages
        are for the dense output only.
    a : (s, s)
        Stages, strictly lower triangular.
    error : (s,)
        Weights of the difference between the two solutions.
    dense : (s, d)
        y(theta) = y0 + h sum_i k_i sum_j dense_ij theta^(j+1).
    second : (s,) or None
        Weights of the second difference of an 8(5,3) pair [6]_.
    compared : int
        Order of the embedded solution; 0: one less than ``order``.
    """

    name: str
    order: int
    dense_order: int
    last: int
    a: Real
    error: Real
    dense: Real
    second: Real | None = None
    compared: int = 0

    @property
    def embedded_order(self) -> int:
        """Order of the embedded solution."""
        return self.compared or self.order - 1

    @property
    def exponent(self) -> float:
        """Exponent of the error in the step size control; combined errors have the full order."""
        return -1.0 / (self.order if self.second is not None else self.embedded_order + 1)

    @property
    def cost(self) -> int:
        """Right-hand sides of an accepted step, including dense output."""
        return len(self.a) - 1


def table(text: str) -> Real:
    """Return the rows of a text, separated by semicolons and padded with zeros on the right.

    Examples
    --------
    >>> table("1/2; 1/4 3")
    array([[0.5 , 0.  ],
           [0.25, 3.  ]])
    """
    rows = [[float(Fraction(x)) for x in row.split()] for row in text.split(";")]
    width = max(map(len, rows))
    return np.array([row + [0.0] * (width - len(row)) for row in rows])


def tabulated(
    name: str, orders: tuple[int, int], last: int, a: str, error: str, dense: str | Real
) -> Pair:
    """Return a pair from its tables; ``a`` lacks the empty first row."""
    rows = table("0;" + a)
    n = len(rows)
    square = np.zeros((n, n))
    square[:, : min(n, rows.shape[1])] = rows
    weights = np.zeros(n)
    weights[: last + 1] = table(error)[0]
    polynomials = table(dense) if isinstance(dense, str) else dense
    return Pair(name, *orders, last, square, weights, polynomials)


def factored(*factors: tuple[float, ...]) -> Real:
    """Return the coefficients of a product of polynomials without the constant term, (4,)."""
    product = np.polynomial.Polynomial([1.0])
    for factor in factors:
        product = product * np.polynomial.Polynomial(factor)
    result = np.zeros(5)
    result[: len(product.coef)] = product.coef
    return result[1:]


def dop853() -> Pair:
    """Return the pair of order 8(5,3), its nested interpolant expanded into powers."""
    n, last = 16, 12
    a = np.zeros((n, n))
    a[:last, :last] = DOP853.A
    a[last, :last] = DOP853.B
    a[last + 1 :] = DOP853.A_EXTRA
    step, first, end = a[last], np.eye(n)[0], np.eye(n)[last]
    nested = [step, first - step, 2 * step - first - end, *DOP853.D]
    dense, basis = np.zeros((n, 7)), np.polynomial.Polynomial([1.0])
    for i, row in enumerate(nested):
        basis = basis * np.polynomial.Polynomial([0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        dense[:, : len(basis.coef) - 1] += np.outer(row, basis.coef[1:])
    fifth, third = (np.pad(e, (0, n - len(e))) for e in (DOP853.E5, DOP853.E3))
    return Pair("DOP853, 3 further", 8, 7, last, a, fifth, dense, third, compared=5)


DORMAND_PRINCE = tabulated(
    "Dormand-Prince 5(4)",
    (5, 4),
    6,
    """1/5; 3/40 9/40; 44/45 -56/15 32/9; 19372/6561 -25360/2187 64448/6561 -212/729;
    9017/3168 -355/33 46732/5247 49/176 -5103/18656;
    35/384 0 500/1113 125/192 -2187/6784 11/84""",
    "71/57600 0 -71/16695 71/1920 -17253/339200 22/525 -1/40",
    """1 -8048581381/2820520608 8663915743/2820520608 -12715105075/11282082432; 0;
    0 131558114200/32700410799 -68118460800/10900136933 87487479700/32700410799;
    0 -1754552775/470086768 14199869525/1410260304 -10690763975/1880347072;
    0 127303824393/49829197408 -318862633887/49829197408 701980252875/199316789632;
    0 -282668133/205662961 2019193451/616988883 -1453857185/822651844;
    0 40617522/29380423 -110615467/29380423 69997945/29380423""",
)

TSITOURAS = tabulated(
    "Tsitouras 5(4)",
    (5, 4),
    6,
    """161/1000; -0.008480655492356989 0.335480655492357;
    2.8971530571054935 -6.359448489975075 4.3622954328695815;
    5.325864828439257 -11.748883564062828 7.4955393428898365 -0.09249506636175525;
    5.86145544294642 -12.92096931784711 8.159367898576159 -0.071584973281401
    -0.028269050394068383;
    0.09646076681806523 1/100 0.4798896504144996 1.379008574103742 -3.290069515436081
    2.324710524099774""",
    """-0.0017800110522257714 -0.0008164344596567469 0.007880878010261995
    -0.1447110071732629 0.5823571654525552 -0.45808210592918697 1/66""",
    np.array(
        [
            factored(
                (0.0, -1.0530884977290216),
                (-1.3299890189751412, 1.0),
                (0.7139816917074209, -1.4364028541716351, 1.0),
            ),
            factored((0.0, 0.0, 0.1017), (1.2949852507374631, -2.1966568338249754, 1.0)),
            factored(
                (0.0, 0.0, 2.490627285651252793), (1.57803468208092486, -2.38535645472061657, 1.0)
            ),
            factored(
                (0.0, 0.0, -16.54810288924490272),
                (-1.21712927295533244, 1.0),
                (-0.61620406037800089, 1.0),
            ),
            factored(
                (0.0, 0.0, 47.37952196281928122),
                (-1.203071208372362603, 1.0),
                (-0.658047292653547382, 1.0),
            ),
            factored((0.0, 0.0, -34.87065786149660974), (-1.2, 1.0), (-2 / 3, 1.0)),
            factored((0.0, 0.0, 2.5), (-1.0, 1.0), (-0.6, 1.0)),
        ]
    ),
)

BOGACKI_SHAMPINE_STAGES = """1/6; 2/27 4/27; 183/1372 -162/343 1053/1372; 68/297 -4/11
    42/143 1960/3861; 597/22528 81/352 63099/585728 58653/366080 4617/20480; 174197/959244
    -30942/79937 8152137/19744439 666106/1039181 -29421/29068 482048/414219; 587/8064 0
    4440339/15491840 24353/124800 387/44800 2152/5985 7267/94080"""
BOGACKI_SHAMPINE_ERROR = """-3817/1959552 0 140181/15491840 -4224731/272937600 8557/403200
    -57928/4363065 -23930231/4366535040 3293/556956"""
BOGACKI_SHAMPINE_NINTH = """; 455/6144 0 10256301/35409920 2307361/17971200 -387/102400
    73/5130 -7267/215040 1/32"""

# Interpolants of order 4 with a continuous derivative, built from the eight stages, have two
# degrees of freedom.  They are chosen here such that the violation of the conditions of order 5
# over the step is smallest (least squares, with the trees weighted by their symmetry).
BOGACKI_SHAMPINE = tabulated(
    "Bogacki-Shampine 5(4)",
    (5, 4),
    7,
    BOGACKI_SHAMPINE_STAGES,
    BOGACKI_SHAMPINE_ERROR,
    """1 -6409/2016 1051/288 -11269/8064; 0; 0 12398103/3872960 -2907981/553280
    7254279/3098368; 0 302869/280800 -386561/280800 110789/224640; 0 -1161/11200 387/1600
    -1161/8960; 0 -28192/17955 11744/2565 -9512/3591; 0 -7267/7840 7267/3360 -7267/6272; 0
    3/2 -4 5/2""",
)

# With the first of the three published stages, the quintic of order 5 with continuous derivative is
# unique.
BOGACKI_SHAMPINE_WITH_1 = tabulated(
    "Bogacki-Shampine 5(4), 1 further",
    (5, 5),
    7,
    BOGACKI_SHAMPINE_STAGES + BOGACKI_SHAMPINE_NINTH,
    BOGACKI_SHAMPINE_ERROR,
    """1 -155/36 16441/2016 -56689/8064 757/336; 0; 0 6561/988 -14727987/774592
    60538347/3098368 -13321017/1936480; 0 2401/702 -603337/56160 2740913/224640
    -24353/5200; 0 0 -387/2240 3483/8960 -1161/5600; 0 1408/513 -45536/3591 67960/3591
    -17216/1995; 0 0 -7267/4704 21801/6272 -7267/3920; 0 -1/2 4 -15/2 4; 0 -8 32 -40 16""",
)

BOGACKI_SHAMPINE_WITH_3 = tabulated(
    "Bogacki-Shampine 5(4), 3 further",
    (5, 5),
    7,
    BOGACKI_SHAMPINE_STAGES
    + BOGACKI_SHAMPINE_NINTH
    + """; -837888343715/13176988637184 30409415/52955362 -48321525963/759168069632
    8530738453321/197654829557760 1361640523001/1626788720640 -13143060689/38604458898
    18700221969/379584034816 -5831595/847285792 -5183640/26477681;
    98719073263/1551965184000 1307/123552 4632066559387/70181753241600
    7828594302389/382182512025600 40763687/11070259200 34872732407/224610586200
    -2561897/30105600 1/10 -1/10 -1403317093/11371610250""",
    BOGACKI_SHAMPINE_ERROR,
    """1 -3547880131/437837400 35856435071/1313512200 -2722545893/59875200
    12923488183/350269920 -12134338393/1050809760; 0; 0 -1046723109/304608304
    4323308999/152304152 -27096444225/374902528 65150312289/870309440
    -33197340367/1218433216; 0 -55058055073/41469456600 3249645975331/248816739600
    -201150852119/5671036800 6343174409579/165877826400 -284800997201/19905339168; 0
    -1772261/10810800 3586937/4054050 -2903933/1478400 85695583/43243200 -540919/741312; 0
    2449079168/623918295 -9134977024/267393555 413114104/5332635 -41174140576/623918295
    7157998304/374350977; 0 -7267/3920 792103/47040 -1329861/31360 94471/2240 -138073/9408;
    0 37/16 -1349/64 3435/64 -3479/64 1245/64; 0 0 -7/3 23 -39 55/3; 0 -423642896/126351225
    11411880511/379053675 -26477681/359975 1774004627/25270245 -1774004627/75810735; 0 12
    -59 117 -105 35""",
)

VERNER_STAGES = """3/50; 519479/27000000 2070721/27000000; 1439/40000 0 4317/40000;
    109225017611/82828840000 0 -417627820623/82828840000 43699198143/10353605000;
    -41.872591664327516 0 159.4325621631375 -122.11921356501003 5.531743066200054;
    -54.430156935316504 0 207.06725136501848 -158.61081378459 6.991816585950242
    -0.018597231062203234; -54.66374178728198 0 207.95280625538936 -159.2889574744995
    7.018743740796944 -0.018338785905045722 -0.0005119484997882099;
    382735282417/11129397249634 0 0 0.2582624555633503 0.4209371189673537
    626271188750/142160006043 -51160788125000/289890548217 163193540017/946795234;
    0.016524159013572806 0 0 0.3053128187514179 0.2071200938201979 -1.293879140655123
    57.11988411588149 -55.87979207510932 0.024830028297766014"""
VERNER_ERROR = """0.008623404282200852 0 0 -0.019434029953152708 0.028450072588037983
    -2.109711061065291 103.45854289996399 -101.39980461914911 1/30"""

# The quintic has two degrees of freedom, chosen as for the Bogacki-Shampine quartic above.
VERNER_WITH_1 = tabulated(
    "Verner 6(5), 1 further",
    (6, 5),
    8,
    VERNER_STAGES,
    VERNER_ERROR,
    """1 -5.466402570522078 11.245013567372748 -9.918871529761411
    17665971110264/5564698624817; 0; 0; 0 6.6286500425785695 -18.422549196424146
    18.250460542929336 -6.198298933520408; 0 6.354454332481037 -21.127651044309147
    25.296624686011953 -10.10249085521649; 0 3.167154776201152 -94.4422389457885
    201.4099959113201 -5010169510000/47386668681; 0 20.268639573631425 3489.1251013387105
    -7921.471716519808 409286305000000/96630182739; 0 -22.459879429421367
    -3402.362909169459 7733.926123634257 -1958322480204/473397617; 0 -0.49261672494873826
    3.9852334498974766 -7.492616724948738 4; 0 -8 32 -40 16""",
)

VERNER_WITH_3 = tabulated(
    "Verner 6(5), 3 further",
    (6, 6),
    8,
    VERNER_STAGES
    + """; 0.038150081818627744 0 0 0.2502358252513705 0.3249441447817608
    1.8224606658327962 -67.7137233269262 66.03587911808127 -0.0363881087495127
    3248339841/30517578125; 0.11178168039666012 0 0 0.025757505109345213 3.785140856363646
    92.34088993695727 -3819.461508432344 3732.492711530704 -1.0756940209963033
    -3.231539970732086 -4.7075390854586345""",
    VERNER_ERROR,
    """1 -7.778593856495575 27.0524385722671 -45.780190114576975 36.72377741043638
    -11.183042432947357; 0; 0; 0 2214248281250000/133130993475189 -86.25583404770623
    171.7330546182696 -149.67744091315947 47.826380659879696; 0 27.10835046149758
    -140.58676162962996 279.9044757968917 -243.95644583707966 77.95131832728772; 0
    40331864555500/142160006043 -5647463071672000/3838320163161
    3747982556193250/1279440054387 -3266630520520000/1279440054387
    3131355943750000/3838320163161; 0 -143250206750000/12603936879
    461347522996000000/7827044801859 -13312037070125000/113435431911
    266854670860000000/2609014933953 -255803940625000000/7827044801859; 0
    3753451420391/338141155 -3679035166143248/63908678295 4883240297928691/42605785530
    -425608752364336/4260578553 407983850042500/12781735659; 0 -69713/23220 4685161/313470
    -135239/4860 228046/10449 -186250/31347; 0 -132664/6765 17011336/182655 -10067296/60885
    1579832/12177 -1385000/36531; 0 -2734375000/149990751 391796875000/4049750277
    -6250000000/31393413 244140625000/1349916759 -244140625000/4049750277; 0
    -15453125/1139292 1393796875/15380442 -2092203125/10253628 488281250/2563407
    -488281250/7690221""",
)

THIRD_ORDER = tabulated(
    "Bogacki-Shampine 3(2)",
    (3, 3),
    3,
    "1/2; 0 3/4; 2/9 1/3 4/9",
    "-5/72 1/12 1/9 -1/8",
    "1 -4/3 5/9; 0 1 -2/3; 0 4/3 -8/9; 0 -1 1",
)

NEW75 = Pair(
    "Tsitouras-Papakostas 7(5)",
    ENGINE.order,
    5,
    len(ENGINE.a) - 1,
    ENGINE.a,
    ENGINE.error,
    ENGINE.dense,
    compared=ENGINE.error_order,
)

PAIRS = (
    DORMAND_PRINCE,
    TSITOURAS,
    BOGACKI_SHAMPINE,
    BOGACKI_SHAMPINE_WITH_1,
    BOGACKI_SHAMPINE_WITH_3,
    VERNER_WITH_1,
    VERNER_WITH_3,
    NEW75,
    dop853(),
    THIRD_ORDER,
)


# -- order conditions --


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """Return the rooted trees with a number of nodes, each as the sorted tuple of its branches.

    Examples
    --------
    >>> [len(trees(n)) for n in range(1, 9)]
    [1, 1, 2, 4, 9, 20, 48, 115]
    """

    def forests(nodes: int, largest: int) -> set[Tree]:
        if nodes == 0:
            return {()}
        return {
            tuple(sorted((branch, *rest)))
            for size in range(1, min(nodes, largest) + 1)
            for branch in trees(size)
            for rest in forests(nodes - size, size)
        }

    return tuple(sorted(forests(order - 1, order - 1)))


def nodes(tree: Tree) -> int:
    """Return the number of nodes of a tree, its order."""
    return 1 + sum(map(nodes, tree))


def density(tree: Tree) -> int:
    """Return gamma, the product of the orders of a tree and of all its subtrees."""
    return nodes(tree) * math.prod(map(density, tree))


def stage_weights(a: Real, tree: Tree) -> Real:
    """Return the elementary weights of all stages, (s,)."""
    result = np.ones(len(a))
    for branch in tree:
        result = result * (a @ stage_weights(a, branch))
    return result


def defect(pair: Pair) -> float:
    """Return the largest violation of an order condition, in units of its round-off.

    The conditions are those of the pair, of the embedded solution, and of the dense output in each
    power of theta.
    """
    worst, n = 0.0, pair.last + 1
    weights = pair.a[pair.last]
    assert np.allclose(pair.dense.sum(axis=1), weights, rtol=0, atol=1e-11)
    powers = np.arange(pair.dense.shape[1]) + 1
    for order in range(1, pair.order + 1):
        for tree in trees(order):
            phi = stage_weights(pair.a, tree)
            size = 1.0 + np.abs(pair.dense).T @ stage_weights(np.abs(pair.a), tree)
            found = [abs(weights @ phi - 1 / density(tree)) / size.max()]
            if order <= pair.embedded_order:
                found.append(abs(pair.error[:n] @ phi[:n]) / size.max())
            if order <= pair.dense_order:
                wanted = (powers == order) / density(tree)
                found.append(float((np.abs(phi @ pair.dense - wanted) / size).max()))
            worst = max(worst, *found)
    return worst / np.finfo(float).eps


# -- problems --


@dataclass(frozen=True)
class Problem:
    """An initial value problem with the times at which its solution is evaluated.

    Parameters
    ----------
    simulation : Simulation
        Equations, constraints and scales.
    start : float
        Initial time [s].
    y : (n,)
        State at the start.
    times : (m,)
        Times of evaluation; the last one ends the motion [s].
    impact : bool
        Whether to apply an impact when the stop first closes.
    """

    simulation: Simulation
    start: float
    y: Real
    times: Real
    impact: bool = False

    def error(self, found: Real, wanted: Real) -> Real:
        """Return the root mean square of the scaled error of the state at each time, (m,)."""
        scales = np.array([self.simulation.configuration.scales.of_state(y) for y in wanted])
        result: Real = np.sqrt((((found - wanted) / scales) ** 2).mean(axis=1))
        return result

    def gap(self, t: float, y: Real) -> float:
        """Return the gap of the first stop [m]."""
        n = self.simulation.system.n
        return float(self.simulation.equations.gaps(t, self.simulation.system.directions(y[:n]))[0])

    def rebound(self, y: Real) -> Real:
        """Return the state after an impact at the first stop."""
        system, n = self.simulation.system, self.simulation.system.n
        at, v = ContactProblem(system, y[:n]), y[n : 2 * n]
        G = at.gaps[:1]
        X = at.response(G)
        P = contact.newton(G @ X, G @ v, np.array([self.simulation.values["stop.restitution"]]))
        result = y.copy()
        result[n : 2 * n] = v + X @ P
        return result


def problem(
    model: str,
    start: float,
    times: Real,
    changes: Mapping[str, float] | None = None,
    impact: bool = False,
) -> Problem:
    """Return the motion of a shipped mechanism from a time, which need not be an event."""
    simulation = Simulation(load(MODELS[model]), changes, tolerance=1e-12)
    simulation.advance(start)
    return Problem(simulation, start, simulation.state().copy(), times, impact)


def reference(problem: Problem) -> Real:
    """Return the states at the times of a smooth arc by SciPy's DOP853, (m, n)."""
    equations, y, t = problem.simulation.equations, problem.y, problem.start
    scales = problem.simulation.configuration.scales.of_state(y)
    states = []
    for end in problem.times:
        if end > t:
            solved = solve_ivp(
                equations.rate, (t, end), y, "DOP853", rtol=1e-13, atol=1e-13 * scales
            )
            y, t = equations.project(end, solved.y[:, -1]), float(end)
        states.append(y)
    return np.array(states)


# -- integration --


@dataclass(frozen=True)
class Run:
    """The states at the times of a problem, and the work of the integration."""

    states: Real
    calls: int
    steps: int
    rejected: int


def integrate(pair: Pair, problem: Problem, *, tolerance: float = 0.0, step: float = 0.0) -> Run:
    """Integrate with a tolerance or with fixed steps, past the last time.

    Parameters
    ----------
    pair : Pair
        The method.
    problem : Problem
        The problem to integrate.
    tolerance : float
        Tolerance relative to the scales of the engine; 0 for fixed steps.
    step : float
        Fixed step size [s]; after an impact the steps restart at its time.
    """
    simulation, times = problem.simulation, problem.times
    equations, scales = simulation.equations, simulation.configuration.scales.of_state
    a, c, last = pair.a, pair.a.sum(axis=1), pair.last
    exponents = np.arange(pair.dense.shape[1]) + 1
    t, y, armed = problem.start, problem.y, problem.impact
    states = np.empty((len(times), len(y)))
    k = np.empty((len(a), len(y)))
    k[0] = equations.rate(t, y)
    calls, steps, rejected, read = 1, 0, 0, 0
    anchor, count, h = t, 0, step
    if not step:
        rate = k[0] / scales(y)
        h = 0.1 * tolerance**0.2 / max(math.sqrt(rate @ rate / len(rate)), 1e-6)
    while read < len(times):
        y1 = y
        for i in range(1, last + 1):
            y1 = y + h * (a[i, :i] @ k[:i])
            k[i] = equations.rate(t + c[i] * h, y1)
        calls += last
        factor = 1.0
        if not step:
            scale = tolerance * scales(np.maximum(np.abs(y), np.abs(y1)))
            error = _size(h * (pair.error[: last + 1] @ k[: last + 1]) / scale)
            if pair.second is not None:
                third = _size(h * (pair.second[: last + 1] @ k[: last + 1]) / scale)
                error = error**2 / math.hypot(error, 0.1 * third) if error else 0.0
            growth = SAFETY * error**pair.exponent if error else GROW
            factor = max(SHRINK, min(GROW, growth))
            if error > 1.0:
                h, rejected = h * factor, rejected + 1
                continue
        for i in range(last + 1, len(a)):
            k[i] = equations.rate(t + c[i] * h, y + h * (a[i, :i] @ k[:i]))
        calls, steps, count = calls + len(a) - last - 1, steps + 1, count + 1

        def at(theta: float, y: Real = y, h: float = h) -> Real:
            result: Real = y + h * ((pair.dense @ theta**exponents) @ k)
            return result

        end, hit = anchor + count * step if step else t + h, None
        if armed and problem.gap(end, y1) <= 0.0:
            hit = brentq(
                lambda x, t=t, h=h, at=at: problem.gap(t + x * h, at(x)), 0.0, 1.0, xtol=1e-15
            )
            end = t + hit * h
        while read < len(times) and times[read] <= end:
            states[read] = equations.project(times[read], at((times[read] - t) / h))
            read += 1
        if hit is None:
            y, k[0] = equations.project(end, y1), k[last]
        else:
            y = problem.rebound(equations.project(end, at(hit)))
            k[0], armed, anchor, count = equations.rate(end, y), False, end, 0
        t, h = end, h * factor
    return Run(states, calls, steps, rejected)


def _size(ratio: Real) -> float:
    return math.sqrt(ratio @ ratio / len(ratio))


# -- work and accuracy --


@dataclass(frozen=True)
class Curve:
    """Largest errors, right-hand sides and steps of a pair, by tolerance."""

    error: Real
    calls: Real
    steps: Real

    def needed(self, target: float, quantity: str = "calls") -> float:
        """Return the calls or steps for a target error, interpolated in logarithms, or NaN."""
        above = np.flatnonzero(self.error > target)
        if not len(above) or above[-1] + 1 == len(self.error):
            return math.nan
        i = above[-1]
        amount = getattr(self, quantity)
        share = math.log(self.error[i] / target) / math.log(self.error[i] / self.error[i + 1])
        return float(amount[i] * (amount[i + 1] / amount[i]) ** share)


def work_and_precision(model: str, given: Real) -> dict[str, Curve]:
    """Run all pairs at tolerances over the arc; low orders without the smallest ones."""
    smooth = problem(model, ARC[0], np.linspace(*ARC, 201))
    wanted = reference(smooth)
    curves = {}
    for pair in PAIRS:
        tolerances = given[given > 3e-8] if pair.order < 5 else given
        runs = [integrate(pair, smooth, tolerance=x) for x in tolerances]
        curves[pair.name] = Curve(
            np.array([smooth.error(run.states, wanted).max() for run in runs]),
            np.array([float(run.calls) for run in runs]),
            np.array([float(run.steps) for run in runs]),
        )
    return curves


def print_work(model: str, curves: Mapping[str, Curve]) -> None:
    """Print right-hand sides, also relative to Dormand-Prince, and accepted steps."""
    base = curves[DORMAND_PRINCE.name]
    print(f"\n{model}: right-hand sides (ratio to {DORMAND_PRINCE.name}; accepted steps) for")
    print(f"{'a largest scaled error of':34s}" + "".join(f"{x:>22.0e}" for x in TARGETS))
    for pair in PAIRS:
        curve = curves[pair.name]
        cells = []
        for target in TARGETS:
            calls = curve.needed(target)
            ratio = calls / base.needed(target)
            cells.append(f"{calls:7.0f} ({ratio:4.2f};{curve.needed(target, 'steps'):6.0f})")
        print(f"{pair.name:34s}" + "".join(f"{cell:>22s}" for cell in cells))


def draw(work: Mapping[str, Mapping[str, Curve]], path: Path) -> None:
    """Draw right-hand sides over errors, one panel per model."""
    figure, axes = plt.subplots(1, len(work), figsize=(11, 4.8), layout="constrained")
    colours = ("0.35", "tab:blue", *["tab:red"] * 3, *["tab:green"] * 2, "tab:purple", "k", "0.6")
    lines = ("-", "-", "-", "--", ":", "-", ":", "-", "--", "--")
    for axis, (model, curves) in zip(axes, work.items(), strict=True):
        for pair, colour, line in zip(PAIRS, colours, lines, strict=True):
            curve = curves[pair.name]
            chosen = pair is NEW75
            axis.loglog(
                curve.error,
                curve.calls,
                line,
                color=colour,
                lw=2.5 if chosen else 1.4,
                label=f"{pair.name}: {pair.cost} per step",
            )
        axis.set(xlabel="largest scaled error", title=f"{model}, {ARC[0]} s to {ARC[1]} s")
        axis.set_xlim(1e-1, 1e-13)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("right-hand sides, including dense output")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)


# -- orders --


def order_problems() -> dict[str, tuple[Problem, float, int]]:
    """Return problems for fixed steps, each with its largest step and number of halvings."""
    damped = {"stop.position": -0.012, "damping.beta": 1e-3}
    return {
        "1R, smooth": (problem("1R", 0.043, np.linspace(0.07, 0.1, 101)), 0.024, 8),
        "1R, across an impact": (
            problem("1R", 0.005, np.linspace(0.0415, 0.08, 101), impact=True),
            0.024,
            8,
        ),
        "2R, smooth": (problem("2R", 0.0, np.linspace(0.01, 0.03, 101)), 1e-3, 8),
        "2R, across an impact": (
            problem("2R", 0.0, np.linspace(0.0245, 0.03, 101), damped, impact=True),
            4e-4,
            7,
        ),
    }


def slope(steps: Real, errors: Real) -> float:
    """Return the slope of a least-squares line through logarithms."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def print_orders() -> None:
    """Print, for each pair and problem, the slopes of all sequences of step sizes."""
    for title, (given, largest, octaves) in order_problems().items():
        steps = largest * 2.0 ** (-np.arange(OCTAVE * octaves + 1) / OCTAVE)
        wanted = integrate(dop853(), given, step=float(steps[-1]) / 2).states
        print(f"\n{title}, steps halved from {largest:g} s: order, closest slope, number of slopes")
        print("within 0.1 of the order; errors; all slopes")
        for pair in PAIRS[:-1]:
            errors = np.array([_fixed(pair, given, float(h), wanted) for h in steps])
            slopes = []
            for i in range(len(steps) - OCTAVE * (SIZES_PER_SLOPE - 1)):
                halved = i + OCTAVE * np.arange(SIZES_PER_SLOPE)
                if np.isfinite(errors[halved]).all():
                    slopes.append(slope(steps[halved], errors[halved]))
            off = np.abs(np.array(slopes) - pair.order)
            closest = slopes[int(off.argmin())] if slopes else math.nan
            print(
                f"{pair.name:34s}{pair.order:2d}{closest:6.2f} {int((off <= 0.1).sum()):2d}  "
                + " ".join(f"{x:.0e}" for x in errors[::OCTAVE])
            )
            print(" " * 47 + " ".join(f"{x:.2f}" for x in slopes))


def _fixed(pair: Pair, given: Problem, h: float, wanted: Real) -> float:
    """Return the root mean square error with a fixed step, NaN if the integration fails."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            found = integrate(pair, given, step=h).states
    except (SimulationError, ArithmeticError, ValueError):
        return math.nan
    return _size(given.error(found, wanted))


def main() -> None:
    """Check the pairs, print the tables and draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("build"),
        help="folder of the figure (default: %(default)s)",
    )
    parser.add_argument(
        "--orders", action="store_true", help="print observed orders instead of work"
    )
    parser.add_argument("--short", action="store_true", help="the two largest tolerances")
    arguments = parser.parse_args()
    for pair in PAIRS:
        worst = defect(pair)
        if not worst < 50.0:
            raise SystemExit(
                f"{pair.name} violates its order conditions by {worst:.3g} times its round-off"
            )
    if arguments.orders:
        print_orders()
        return
    tolerances = TOLERANCES[:2] if arguments.short else TOLERANCES
    work = {model: work_and_precision(model, tolerances) for model in MODELS}
    for model, curves in work.items():
        print_work(model, curves)
    path = arguments.out / "work_precision.png"
    draw(work, path)
    print(f"\n{path}")


if __name__ == "__main__":
    main()
