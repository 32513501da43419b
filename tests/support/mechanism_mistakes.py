"""A mechanism file with every table and key, and mistakes in it with their messages.

``CHANGES`` maps the name of a mistake to a text, its replacement and a part of the message.
``CONTENTS`` maps the name of a mistake to the content of a file and a part of the message.
"""

from prbm.files.mechanism_file import FILE_SIZE_MAX
from prbm.mechanism.flexure import LINKS_MAX

EXAMPLE = """\
#:schema mechanism.schema.json
#  ground --- arm --- tip
name = "Striker"
title = "An arm on a leaf that strikes an anvil, which hangs on a pin"
gravity = ["0 m/s2", "-981 cm/s2"]
damping_zeta = 0.01
damping_beta = "8 us"

[[geometry]]
name = "arm.length"
value = "40 mm"
minimum = "1 nm"

[[geometry]]
name = "ratio"
value = 0.5

[[materials]]
name = "steel"
youngs_modulus = "181.5 GPa"
density = "7.8 g/cm3"
yield_strength = "1.2 GPa"
tensile_strength = "1500 MPa"
fatigue_strength = "450 MPa"
fatigue_cycles = 1e7

[[flexure_types]]
name = "leaf"
model = "2R"
thickness = "0.1 mm"
width = "8 mm"
material = "steel"
stress = true

[ground]
foot = [0, 0]
side = [0, "10 mm"]
far = ["arm.length + 2 cm", "50 mm"]

[[bodies]]
name = "arm"
mass = "53.187 g"
inertia = "28366.4 g.mm2"
centre = ["arm.length/2 + 3 mm", 0.0]

[bodies.points]
root = ["20 mm", 0.0]
tip = ["arm.length", "0 m"]

[[bodies]]
name = "anvil"
mass = "2e-3 kg"
inertia = 1e-6
centre = [0.06, 0.0]
points.top = ["arm.length + 2 cm", "20 mm"]
points.hook = ["arm.length", 0]

[[flexures]]
name = "left"
type = "leaf"
start = "ground.foot"
end = "arm.root"

[[flexures]]
name = "right"
model = "nR"
n = 8
thickness = "50 um"
width = 8e-3
material = "steel"
axial = true
start = "ground.side"
end = "arm.root"
ends = "clamp"

[[flexures]]
name = "hanger"
model = "1R"
thickness = 1e-4
width = "8 mm"
youngs_modulus = "70 GPa"
density = 2700
coefficients = { gamma = 0.85 }
start = "ground.far"
end = "anvil.top"
ends = ["clamp", "pin"]

[[joints]]
name = "hook"
start = "arm.tip"
end = "anvil.hook"

[[stops]]
name = "wall"
body = "arm"
point = "arm.tip"
direction = "-90 deg"
position = "2 mm"
on = "anvil"

[[frictions]]
name = "rub"
body = "arm"
point = ["1 cm", "2 mm"]
normal_force = "3 mN"
normal_stiffness = "2 N/mm"

[[forces]]
name = "push"
body = "arm"
point = "arm.tip"

[[forces]]
name = "pull"
body = "anvil"

[[probes]]
name = "watch"
point = "arm.tip"

[release]
body = "arm"
direction = "1.5707963267948966 rad"
displacement = "-3 mm"
"""

HANGER = 'youngs_modulus = "70 GPa"\ndensity = 2700\n'
LEFT = 'type = "leaf"\nstart = "ground.foot"\nend = "arm.root"\n'
ANVIL = 'mass = "2e-3 kg"\ninertia = 1e-6\ncentre = [0.06, 0.0]\n'
TRIANGLE = """\
outline = [[0.05, 0], [0.06, 0], [0.06, 0.02]]
thickness = 1e-3
material = "steel"
"""
HOLE = "[[0.055, 0.002], [0.057, 0.002], [0.057, 0.003]]"
MISSPELT = HOLE.replace("0.057", '"arm.lenght"', 1)
RIGHT = 'thickness = "50 um"\nwidth = 8e-3\nmaterial = "steel"\n'
CHANGES = {
    # units
    "unknown unit": ('"53.187 g"', '"3 furlong"', "bodies.0.mass (of arm) = '3 furlong': the unit"),
    "wrong dimension": (
        '"0.1 mm"',
        '"3 kg"',
        "flexure_types.0.thickness (of leaf) = '3 kg': the unit",
    ),
    "unit of another dimension in an expression": (
        "/2 + 3 mm",
        "/2 + 3 s",
        "the unit 's' has another",
    ),
    "unknown unit in an expression": ("/2 + 3 mm", "/2 + 3 ell", "the unit 'ell' is unknown"),
    "product of units": ("/2 + 3 mm", "* 3 mm", "must be a term of a sum"),
    "unit of gravity": ('"-981 cm/s2"', '"-981 cm"', "gravity.1 = '-981 cm': the unit 'cm'"),
    "direction in metres": ('"-90 deg"', '"-90 m"', "stops.0.direction (of wall)"),
    "value in another unit": (
        "value = 0.5",
        'value = "5 mm"\nunit = "kg"',
        "geometry.1.value (of ratio) = '5 mm': the unit 'mm' has another dimension",
    ),
    "minimum in another unit": ('"1 nm"', '"1 ng"', "geometry.0.minimum (of arm.length)"),
    "unit that is not SI": (
        '"40 mm"',
        '40\nunit = "mm"',
        "arm.length has the unit 'mm': not an SI unit",
    ),
    "unit of a parameter unknown": (
        "= 0.5",
        '= 5\nunit = "ell"',
        "ratio has the unit 'ell': the unit",
    ),
    "unit in a coefficient": ("gamma = 0.85", 'gamma = "85 mm"', "write a number without a unit"),
    # types
    "text as a number": (
        "damping_zeta = 0.01",
        'damping_zeta = "much"',
        "damping_zeta = 'much': write",
    ),
    "expression as gravity": (
        '"-981 cm/s2"',
        '"ratio"',
        "gravity.1 = 'ratio': write a number in m",
    ),
    "list as a number": ('mass = "53.187 g"', "mass = [1, 2]", "(of arm) = [1, 2]: write a number"),
    "list as a value": (
        "value = 0.5",
        "value = [1]",
        "geometry.1.value (of ratio) = [1]: write a number",
    ),
    "boolean as a number": (
        'mass = "53.187 g"',
        "mass = true",
        "(of arm) = True: write a number, or",
    ),
    "date as a number": (
        'mass = "53.187 g"',
        "mass = 2020-01-01",
        "write a number, or an expression",
    ),
    "number as a name": ('name = "leaf"', "name = 7", "flexure_types.0.name = 7: write a text"),
    "number as a title": ("title = ", "title = 3 # ", "title = 3: write a text in quotes"),
    "text as a boolean": (
        "axial = true",
        'axial = "yes"',
        "axial (of right) = 'yes': write true or",
    ),
    "fractional number of links": (
        "n = 8",
        "n = 8.5",
        "flexures.1.n (of right) = 8.5: write a whole number",
    ),
    "gravity with three numbers": ('"0 m/s2", ', "0, 0, ", "remove the surplus values"),
    "gravity with one number": ('"0 m/s2", ', "", "a number is missing; add it"),
    "point with one number": (
        "side = [0, ",
        "side = [",
        "ground.side = ['10 mm']: a number is missing",
    ),
    "point that is a number": (
        'point = ["1 cm", "2 mm"]',
        "point = 1",
        "frictions.0.point (of rub)",
    ),
    "point without a body": (
        'point = "arm.tip"\ndir',
        'point = "tip"\ndir',
        "write the name of a point",
    ),
    "array instead of table": (
        "[release]",
        "[[release]]",
        "release is a list of tables: write [release]",
    ),
    "table instead of array": (
        "[[joints]]",
        "[joints]",
        "joints is a table: write [[joints]] for each part",
    ),
    "gravity without its direction": (
        'gravity = ["0 m/s2", "-981 cm/s2"]',
        "gravity = 9.81",
        "gravity = 9.81: write a pair, gravity = [0, -9.81]",
    ),
    "states without a list": (
        'gravity = ["0 m/s2", "-981 cm/s2"]',
        'states = "arm.angle"',
        "states = 'arm.angle': write a list of coordinates, states = [\"crank.angle\"]",
    ),
    "value instead of a table of points": (
        '[bodies.points]\nroot = ["20 mm", 0.0]\ntip = ["arm.length", "0 m"]\n',
        "points = 3\n",
        "bodies.0.points (of arm) = 3: write [bodies.points]",
    ),
    "table as a number": (
        'mass = "53.187 g"',
        "mass = { value = 1 }",
        "bodies.0.mass (of arm) is a table: write a number",
    ),
    "ground as an array": ("[ground]", "[[ground]]", "ground is a list of tables: write [ground]"),
    "value instead of an array": (
        '[[probes]]\nname = "watch"\npoint = "arm.tip"\n',
        "[probes]\n",
        "probes is a table: write [[probes]]",
    ),
    # keys
    "unknown key": ("inertia = 1e-6", "inertai = 1e-6", "did you mean inertia?"),
    "unknown key of the file": ("title = ", "titel = ", "unknown key titel; did you mean title?"),
    "unknown table": (
        "[[probes]]",
        "[[prones]]",
        "unknown key prones; did you mean probes?",
    ),
    "key of another part": (
        "n = 8",
        "travel = 8",
        "allowed keys are name, model, n, order, nodes, thickness, width",
    ),
    "missing key": ("inertia = 1e-6\n", "", "anvil.inertia is missing: add the key, or outline"),
    "body without mass": ('mass = "2e-3 kg"\n', "", "anvil.mass is missing: add the key, or"),
    "missing release": ("[release]", "[relaese]", "unknown key relaese; did you mean release?"),
    "key defined twice": ("damping_zeta = 0.01", "name = 'x'", "(at line 6, column "),
    "table defined twice": ("[release]", "[ground]", "line 121"),
    # names
    "name of two parts": ('name = "anvil"', 'name = "arm"', "the name 'arm' is used twice"),
    "name of two types": ('name = "hanger"', 'name = "leaf"', "the name 'leaf' is used twice"),
    "name of two materials": (
        "[[flexure_types]]",
        "[[materials]]\nname = 'steel'\ndensity = 1\nyoungs_modulus = 1\n[[flexure_types]]",
        "'steel' is used twice",
    ),
    "material and body of one name": (
        'name = "steel"',
        'name = "arm"',
        "'arm' is used twice or reserved",
    ),
    "name that is reserved": (
        'name = "rub"',
        'name = "energy"',
        "'energy' is used twice or reserved",
    ),
    "parameter defined twice": (
        '"ratio"',
        '"arm.mass"',
        "the parameter 'arm.mass' is defined twice",
    ),
    "mechanism named by a keyword": (
        'name = "Striker"',
        'name = "class"',
        "mechanism name 'class'",
    ),
    "mechanism named as a device": (
        'name = "Striker"',
        'name = "Nul"',
        "mechanism name 'Nul': Windows has a device of this name",
    ),
    "mechanism named by a path": (
        '"Striker"',
        '"../../etc/x"',
        "mechanism name '../../etc/x': use letters",
    ),
    "name that is empty": ('"Striker"', '""', "mechanism name ''"),
    "name too long": ('"Striker"', f'"{"x" * 300}"', "write a shorter name, of at most 100"),
    "part named by a path": ('name = "anvil"', 'name = "../anvil"', "bodies.1.name (of ../anvil)"),
    "part named by a keyword": ('name = "anvil"', 'name = "lambda"', "a keyword of Python"),
    "part with a name too long": ('name = "rub"', f'name = "{"x" * 300}"', "write a shorter name"),
    "point with spaces": ("side = [0", '"my side" = [0', "ground.my side = 'my side': use letters"),
    "ground point far away": (
        '"50 mm"]',
        '"5e12 m"]',
        "ground.far is drawn at (0.06 m, 5e+12 m): draw the mechanism within 1000 m",
    ),
    "point of a body far away": (
        'root = ["20 mm"',
        "root = [1e300",
        "arm.root is drawn at (1e+300",
    ),
    # references
    "missing point": (
        'end = "anvil.hook"',
        'end = "anvil.nose"',
        "hook refers to the point 'anvil.nose",
    ),
    "body of a point undefined": (
        '"anvil.top"',
        '"hammer.top"',
        "the point 'hammer.top', which",
    ),
    "probe of an undefined point": (
        'name = "watch"\npoint = "arm.tip"',
        'name = "watch"\npoint = "arm.x"',
        "watch refers to the point 'arm.x'",
    ),
    "stop at a point of another body": (
        'point = "arm.tip"\ndir',
        'point = "anvil.top"\ndir',
        "wall.point = 'anvil.top' is not a point of the body arm",
    ),
    "stop at a point of an unknown body": (
        'body = "arm"\npoint = "arm.tip"\ndir',
        'body = "harm"\npoint = "arm.tip"\ndir',
        "wall.body = 'harm' is not defined; choose one of arm, anvil",
    ),
    "force at a point of an unknown body": (
        'body = "arm"\npoint = "arm.tip"\n\n[[forces]]',
        'body = "harm"\npoint = "arm.tip"\n\n[[forces]]',
        "push.body = 'harm' is not defined; choose one of arm, anvil",
    ),
    "release of a point of an unknown body": (
        'body = "arm"\ndirection = "1.5',
        'body = "harm"\npoint = "arm.tip"\ndirection = "1.5',
        "release.body = 'harm' is not defined; choose one of arm, anvil",
    ),
    "stop of an unknown body": (
        'body = "arm"\npoint = "arm.tip"\ndir',
        'body = "harm"\npoint = [0, 0]\ndir',
        "wall.body = 'harm' is not defined",
    ),
    "stop on itself": ('on = "anvil"', 'on = "arm"', "wall is fixed to the body that it stops"),
    "stop on an undefined body": ('on = "anvil"', 'on = "air"', "wall.on = 'air' is not defined"),
    "force on an undefined body": (
        'name = "pull"\nbody = "anvil"',
        'name = "pull"\nbody = "x"',
        "pull.body",
    ),
    "release of an unknown body": (
        'body = "arm"\ndirection = "1.57',
        'body = "a"\ndirection = "1.57',
        "release.body = 'a' is not defined",
    ),
    "unknown type": ('type = "leaf"', 'type = "leave"', "left.type = 'leave' is not defined"),
    "unknown parameter": (
        '"arm.length + 2 cm", "50',
        '"arm.lenght + 2 cm", "50',
        "ground.far refers to 'arm.lenght'",
    ),
    "cycle of references": (
        'mass = "53.187 g"\ninertia = "28366.4 g.mm2"',
        'mass = "arm.inertia"\ninertia = "arm.mass"',
        "arm.mass refers to 'arm.inertia', which is an expression, not a parameter",
    ),
    "reference to itself": (
        'mass = "53.187 g"',
        'mass = "2*arm.mass"',
        "arm.mass refers to 'arm.mass', which is an expression, not a parameter",
    ),
    "parameter that is an expression": (
        "value = 0.5",
        'value = "2*ratio"',
        "geometry.1.value (of ratio",
    ),
    # materials and sections
    "strength without a unit": (
        'yield_strength = "1.2 GPa"',
        "yield_strength = 1.2e9",
        'write the strength with its unit, for example "1500 MPa"',
    ),
    "strength of another quantity": ('"1500 MPa"', '"1500 mm"', "tensile_strength"),
    "strength of zero": ('"1.2 GPa"', '"0 GPa"', "must be between 1 and 1e+12 Pa"),
    "fatigue without cycles": (
        "fatigue_cycles = 1e7",
        "",
        "give fatigue_strength and fatigue_cycles, or none of them",
    ),
    "fatigue without tensile strength": (
        'tensile_strength = "1500 MPa"',
        "",
        "fatigue_strength needs tensile_strength: add it",
    ),
    "fatigue strength as large as the tensile strength": (
        '"450 MPa"',
        '"1.5 GPa"',
        "fatigue_strength must be less than 0.9 of tensile_strength",
    ),
    "too few cycles": (
        "fatigue_cycles = 1e7",
        "fatigue_cycles = 100",
        "fatigue_cycles must be between",
    ),
    "material unknown": (
        'material = "steel"\naxial',
        'material = "stel"\naxial',
        "right.material = 'stel' is not defined; materials are steel",
    ),
    "both material and density": (
        'material = "steel"\naxial',
        'material = "steel"\ndensity = 1\naxial',
        "right has material as well as density: remove one of them",
    ),
    "neither material nor density": (
        HANGER,
        "",
        "hanger has no material: add material with the name of one",
    ),
    "density missing": (
        "density = 2700\n",
        "",
        "hanger has no material: add material with the name of one, or density",
    ),
    "type and section": (
        'type = "leaf"',
        'type = "leaf"\nwidth = 1',
        "left has type as well as width: remove one of them",
    ),
    "no type and no section": (
        'type = "leaf"\n',
        "",
        "left.model is missing: add the key, or the type",
    ),
    "section without width": (RIGHT, RIGHT.replace("width = 8e-3\n", ""), "right.width is missing"),
    "negative thickness": ('"0.1 mm"', '"-0.1 mm"', "leaf.thickness = -0.0001 m must be at least"),
    "negative thickness by expression": (
        '"0.1 mm"',
        '"0.1 mm - arm.length"',
        "leaf.thickness = -0.0399",
    ),
    "too dense": (
        "density = 2700",
        "density = 2700e9",
        "hanger.density = 2.7e+12 kg/m3 must be at most",
    ),
    "coefficient of another model": (
        "gamma = 0.85",
        "gamma1 = 0.85",
        "hanger.gamma1 is not a coefficient",
    ),
    "unknown model": (
        'model = "2R"',
        'model = "7R"',
        "leaf.model = '7R' is unknown: choose one of",
    ),
    "n missing": ("n = 8\n", "", "right.n = 0 must be the number of links of the chain"),
    "n too large": ("n = 8\n", "n = 100000\n", f"from 1 to {LINKS_MAX}"),
    "n of zero": (
        "n = 8\n",
        "n = 0\n",
        "flexures.1.n (of right) = 0: write a number of at least 1",
    ),
    "n of a 2R model": (
        'model = "2R"',
        'model = "2R"\nn = 3',
        "leaf.n = 3: the 2R model has a fixed number",
    ),
    # bodies that are cut from a plate
    "mass and density": (
        "inertia = 1e-6",
        'inertia = 1e-6\nmaterial = "steel"',
        "anvil has mass and inertia and centre as well as material: give mass, inertia and centre,",
    ),
    "mass and payload": (
        "inertia = 1e-6",
        "inertia = 1e-6\npayload = 1e-3",
        "anvil has mass and inertia and centre as well as payload: give mass, inertia and centre,",
    ),
    "negative payload": (
        ANVIL,
        TRIANGLE.replace("thickness = 1e-3\n", 'thickness = 1e-3\npayload = "-5 g"\n'),
        "anvil.payload = -0.005 kg must not be negative",
    ),
    "ground part of two corners": (
        "[[bodies]]",
        "[[ground_parts]]\noutline = [[0, 0], [1, 0]]\n\n[[bodies]]",
        "ground_parts: write at least 3 corners",
    ),
    "ground part far away": (
        "[[bodies]]",
        "[[ground_parts]]\noutline = [[0, 0], [1, 0], [0, 1e9]]\n\n[[bodies]]",
        "ground_parts is drawn at (0 m, 1e+09 m): draw the mechanism within 1000 m",
    ),
    "plate without a thickness": (
        ANVIL,
        TRIANGLE.replace("thickness = 1e-3\n", ""),
        "anvil.thickness is missing: add the key, or give mass, inertia and centre",
    ),
    "plate without an outline": (
        ANVIL,
        'thickness = 1e-3\nmaterial = "steel"\n',
        "anvil.outline is missing: add the key",
    ),
    "plate without a material": (
        ANVIL,
        TRIANGLE.replace('material = "steel"\n', ""),
        "anvil has no material: add material with the name of one, or density",
    ),
    "plate of an unknown material": (
        ANVIL,
        TRIANGLE.replace("steel", "stele"),
        "anvil.material = 'stele' is not defined; materials are steel",
    ),
    "plate with material and density": (
        ANVIL,
        f"{TRIANGLE}density = 1000\n",
        "anvil has material as well as density: remove one of them",
    ),
    "plate without density": (
        ANVIL,
        TRIANGLE.replace('material = "steel"', "density = 0"),
        "anvil.density = 0 kg/m3 must be at least 1 kg/m3",
    ),
    "plate of zero thickness": (
        ANVIL,
        TRIANGLE.replace("1e-3", "0"),
        "anvil.thickness = 0 m must be at least 1e-09 m",
    ),
    "thickness of a plate as an expression": (
        ANVIL,
        TRIANGLE.replace("1e-3", '"arm.length"'),
        "bodies.1.thickness (of anvil) = 'arm.length': write a number in m",
    ),
    "outline with two corners": (
        ANVIL,
        TRIANGLE.replace(", [0.06, 0.02]", ""),
        "anvil.outline has 2 corners: write 3 to 1000 corners",
    ),
    "outline that crosses itself": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", "[0.05, 0.02], [0.04, 0.02], [0.06, 0.01]"),
        "anvil.outline crosses or touches itself: at its sides that begin at (0.06 m, 0 m) and",
    ),
    "outline without an area": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", "[0.055, 0]"),
        "anvil.outline crosses or touches itself",
    ),
    "corner given twice": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", "[0.06, 0.02], [0.06, 0.02]"),
        "anvil.outline has the corner (0.06 m, 0.02 m) twice: remove one",
    ),
    "outline that changes its shape": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", '["arm.length", 0.02]'),
        "anvil.outline changes its shape with arm.length: write its dimensions as numbers",
    ),
    "outline with an undefined parameter": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", '["arm.lenght", 0.02]'),
        "anvil.outline refers to 'arm.lenght', which is not a parameter of Striker; did you mean",
    ),
    "hole with an undefined parameter": (
        ANVIL,
        f"{TRIANGLE}holes = [{MISSPELT}]\n",
        "anvil.holes refers to 'arm.lenght', which is not a parameter of Striker; did you mean",
    ),
    "corner at a point with an undefined parameter": (
        ANVIL + 'points.top = ["arm.length + 2 cm", "20 mm"]\n',
        TRIANGLE.replace("[0.06, 0.02]", '"top"') + 'points.top = ["arm.lenght + 2 cm", 0.02]\n',
        "anvil.top refers to 'arm.lenght', which is not a parameter of Striker; did you mean",
    ),
    "corner that is no point": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", '"nose"'),
        "anvil.outline: 'nose' is not a point of the body anvil; its points are top, hook",
    ),
    "corner with a unit": (
        ANVIL,
        TRIANGLE.replace("[0.06, 0.02]", '"6 cm"'),
        "bodies.1.outline.2 (of anvil) = '6 cm': write a list of corners",
    ),
    "hole without its own list": (
        ANVIL,
        f'{TRIANGLE}holes = [["55 mm"]]\n',
        "bodies.1.holes.0.0 (of anvil) = '55 mm': write a list of corners, [[..., ...], ",
    ),
    "hole outside the outline": (
        ANVIL,
        f"{TRIANGLE}holes = [[[0, 0], [1e-3, 0], [0, 1e-3]]]\n",
        "anvil.holes: a hole at (0 m, 0 m) is not inside the outline",
    ),
    "hole across the outline": (
        ANVIL,
        f"{TRIANGLE}holes = [[[0.055, 0.002], [0.07, 0.003], [0.055, 0.003]]]\n",
        "anvil.holes: a hole at (0.055 m, 0.002 m) is not inside the outline",
    ),
    "holes that overlap": (
        ANVIL,
        f"{TRIANGLE}holes = [{HOLE}, {HOLE.replace('0.003', '0.004')}]\n",
        "anvil.holes: the holes at (0.055 m, 0.002 m) and (0.055 m, 0.002 m) overlap",
    ),
    "holes without an outline": (
        "inertia = 1e-6",
        f"inertia = 1e-6\nholes = [{HOLE}]",
        "anvil.holes needs an outline: add the key outline",
    ),
    # copies
    "mirror about an unknown axis": (
        LEFT,
        f'{LEFT}mirror = "z = 0"\n',
        "flexures.0.mirror (of left) = 'z = 0': write the line of symmetry, \"x = 0\" or",
    ),
    "mirror without a line": (LEFT, f'{LEFT}mirror = "x"\n', "write the line of symmetry"),
    "mirror at a mass": (LEFT, f'{LEFT}mirror = "x = 3 kg"\n', "'kg' has another dimension"),
    "mirror without a unit": (
        LEFT,
        f'{LEFT}mirror = "x = 3"\n',
        '3 has no unit: write a unit after each number, as in "3 m"\n',
    ),
    "outline that is a number": (
        ANVIL,
        "outline = 3\n",
        "bodies.1.outline (of anvil) = 3: write a list of corners",
    ),
    "holes that are a number": (
        ANVIL,
        f"{TRIANGLE}holes = 3\n",
        "bodies.1.holes (of anvil) = 3: write a list of corners, [[..., ...], [..., ...], [..., .",
    ),
    "mirror with a number": (
        LEFT,
        f"{LEFT}mirror = 3\n",
        "flexures.0.mirror (of left) = 3: write the line of symmetry",
    ),
    "mirror with three lines": (
        LEFT,
        f'{LEFT}mirror = ["x = 0", "y = 0", "x = 1 m"]\n',
        "remove the surplus values",
    ),
    "mirror with an unknown parameter": (
        LEFT,
        f'{LEFT}mirror = "y = arm.lenght"\n',
        "left.mirror: ground.foot_mirrored_y refers to 'arm.lenght', which is not a parameter",
    ),
    "copy with the name of another part": (
        LEFT,
        f'{LEFT}mirror = "x = 1 mm"\n',
        "left.mirror: the name 'right' of a copy is used twice or reserved; rename left or the",
    ),
    "copy with the name of another copy": (
        LEFT,
        f'{LEFT}mirror = ["y = 1 mm", "y = 2 mm"]\n',
        "left.mirror: the name 'left_mirrored_y' of a copy is used twice",
    ),
    "copy with a name too long": (
        'name = "left"',
        f'name = "{"a" * 99}"\nrepeat = {{ count = 2, step = [0, "1 mm"] }}',
        "_2' of a copy is too long",
    ),
    "flexure on its line of symmetry": (
        LEFT,
        f'{LEFT}mirror = "y = 0"\n',
        "left.mirror: a copy of left joins the same points; remove mirror",
    ),
    "body on its line of symmetry": (
        "inertia = 1e-6",
        'inertia = 1e-6\nmirror = "y = 0"',
        "anvil.mirror: a copy of the body anvil is at the same place; remove mirror",
    ),
    "image of a point drawn elsewhere": (
        'points.hook = ["arm.length", 0]\n',
        'points.hook = ["arm.length", 0]\npoints.bottom = ["arm.length", 0]\n\n'
        '[[flexures]]\nname = "upper"\ntype = "leaf"\nstart = "ground.far"\nend = "anvil.top"\n'
        'mirror = "y = 0"\n',
        "upper.mirror: the image of anvil.top is anvil.bottom = [arm.length + 0.02, -0.02 m], but "
        "that point is drawn at [arm.length, 0 m]; move or rename it",
    ),
    "copy far away": (
        LEFT,
        f'{LEFT}mirror = "y = 900 m"\n',
        "left.mirror: ground.foot_mirrored_y is drawn at (0 m, 1800 m): draw",
    ),
    "repeat of zero parts": (
        LEFT,
        f"{LEFT}repeat = {{ count = 0, step = [0, 1] }}\n",
        "flexures.0.repeat.count (of left) = 0: write a number of at least 1",
    ),
    "repeat of too many parts": (
        LEFT,
        f"{LEFT}repeat = {{ count = 1001, step = [0, 1] }}\n",
        "flexures.0.repeat.count (of left) = 1001: write a number of at most 1000",
    ),
    "repeat without a step": (
        LEFT,
        f"{LEFT}repeat = {{ count = 2 }}\n",
        "left.repeat has neither step nor angle: give one of them",
    ),
    "repeat with a step and an angle": (
        LEFT,
        f"{LEFT}repeat = {{ count = 2, step = [0, 1], angle = 3 }}\n",
        "left.repeat has step as well as angle: give one of them",
    ),
    "repeat at the same place": (
        LEFT,
        f"{LEFT}repeat = {{ count = 2, step = [0, 0] }}\n",
        "left.repeat: a copy of left joins the same points; remove repeat",
    ),
    "repeat with an unknown key": (
        LEFT,
        f"{LEFT}repeat = {{ number = 2 }}\n",
        "unknown key flexures.0.repeat.number (of left); allowed keys are count, step, angle, abo",
    ),
    "repeat that is a number": (LEFT, f"{LEFT}repeat = 3\n", "flexures.0.repeat (of left) = 3: wr"),
    # geometry of the drawing
    "ends with a number": (
        'ends = "clamp"',
        "ends = 1",
        "(of right) = 1: write clamp, pin or free",
    ),
    "ends wrong": (
        'ends = "clamp"',
        'ends = "glue"',
        "right.ends = ('glue', 'glue'): choose each end among",
    ),
    "three ends": ('ends = ["clamp", "pin"]', 'ends = ["clamp", "pin", "pin"]', "flexures.2.ends"),
    "only one end": ('ends = ["clamp", "pin"]', 'ends = ["clamp"]', "clamp']: an end is missing"),
    "free at both ends": (
        'ends = "clamp"',
        'ends = "free"',
        "a free end needs a clamp at the other",
    ),
    "free and pinned": ('ends = "clamp"', 'ends = ["pin", "free"]', "a free end needs a clamp"),
    "tolerance of an unknown parameter": (
        "[release]",
        '[tolerances]\nhanger.widht = "2 %"\n[release]',
        "tolerances.hanger.widht: unknown variable 'hanger.widht'; did you mean hanger.width",
    ),
    "tolerance without a width": (
        "[release]",
        '[tolerances]\nhanger.width = "0 mm"\n[release]',
        "tolerances.hanger.width = 0 mm: a tolerance of +- 0 must be positive",
    ),
    "tolerance without a unit": (
        "[release]",
        '[tolerances]\nhanger.width = "0.02 uniform"\n[release]',
        "tolerances.hanger.width = '0.02 uniform': write the distance",
    ),
    "tolerance about a value": (
        "[release]",
        '[tolerances]\nhanger.width = "8 mm +- 2 %"\n[release]',
        "write the distance of the limits from the value",
    ),
    "flexure of one body": (
        '"anvil.top"',
        '"ground.foot"',
        "flexure hanger joins ground to itself",
    ),
    "joint of one body": (
        'end = "anvil.hook"',
        'end = "arm.root"',
        "joint hook joins arm to itself",
    ),
    "zero-length flexure": (
        "foot = [0, 0]",
        'foot = ["2 cm", 0]',
        "flexure left from ground.foot to arm",
    ),
    "thickness in mm without its unit": (
        'thickness = "0.1 mm"',
        "thickness = 0.1",
        "leaf.thickness = 0.1 m is not less than the length of the flexure left, 0.02 m: check the",
    ),
    "thickness in mm of a flexure's own section": (
        "thickness = 1e-4",
        "thickness = 0.1",
        "hanger.thickness = 0.1 m is not less than the length of the flexure hanger, 0.03 m: check",
    ),
    "flexure as long as it is thick": (
        'thickness = "0.1 mm"',
        'thickness = "20 mm"',
        "leaf.thickness = 0.02 m is not less than the length of the flexure left, 0.02 m",
    ),
    "taper as thick as it is long": (
        'model = "2R"\nthickness = "0.1 mm"',
        'model = "beam"\nprofile = "taper"\nend_thickness = 0.2\nthickness = "0.1 mm"',
        "leaf.end_thickness = 0.2 m is not less than the length of the flexure left, 0.02 m: check",
    ),
    "notch longer than its flexure": (
        'model = "2R"\nthickness = "0.1 mm"',
        'model = "beam"\nprofile = "notch"\nnotch_radius = 0.012\nend_thickness = 0.05\n'
        'thickness = "0.1 mm"',
        "flexure left: its notch of the length 0.024 m is longer than the flexure, 0.02 m",
    ),
    "joint of points drawn apart": (
        'points.hook = ["arm.length", 0]',
        "points.hook = [0.041, 0]",
        "joint hook: arm.tip and anvil.hook are drawn 0.001 m apart",
    ),
    # numbers
    "not a number": (
        "damping_zeta = 0.01",
        "damping_zeta = nan",
        "damping_zeta = nan: write a finite",
    ),
    "infinite": (
        'mass = "53.187 g"',
        "mass = inf",
        "bodies.0.mass (of arm) = inf: write a finite number",
    ),
    "huge": ('mass = "53.187 g"', "mass = 1e300", "arm.mass = 1e+300 kg must be at most 1e+06 kg"),
    "huge with a unit": ('"53.187 g"', '"1e999 g"', "(of arm) = '1e999 g': write a finite number"),
    "huge whole": ('mass = "53.187 g"', f"mass = {'9' * 400}", "write a finite number"),
    "thousands of digits": (
        'mass = "53.187 g"',
        f"mass = {'9' * 9999}",
        "a number has thousands of digits",
    ),
    "damping out of bounds": (
        "damping_zeta = 0.01",
        "damping_zeta = 11",
        "damping.zeta = 11 must be",
    ),
    "value out of its own bounds": (
        '"40 mm"',
        '"0.1 nm"',
        "arm.length = 1e-10 m must be at least 1e",
    ),
    "bound that is not a number": (
        '"1 nm"',
        "nan",
        "geometry.0.minimum (of arm.length) = nan: write a finite",
    ),
    # expressions
    "product of two parameters": ("/2 + 3 mm", "*ratio", "(a product of two parameters)"),
    "division by zero": (
        "/2 + 3 mm",
        "/0",
        "bodies.0.centre.0 (of arm): cannot read the expression",
    ),
    "division by a parameter": ("/2 + 3 mm", "/ratio", "(a division by a parameter)"),
    "call": ("arm.length/2 + 3 mm", "abs(arm.length)", "'abs(arm.length)' is not allowed"),
    "code": ("arm.length/2 + 3 mm", "__import__('os').system('x')", "cannot read the expression"),
    "no expression": (
        "arm.length/2 + 3 mm",
        "",
        "bodies.0.centre.0 (of arm): cannot read the expression ''",
    ),
    "half an expression": ("arm.length/2 + 3 mm", "arm.length +", "cannot read the expression"),
    "parentheses": ("arm.length/2 + 3 mm", "(" * 900, "cannot read the expression"),
    "long expression": ("arm.length/2 + 3 mm", "1+" * 9999 + "1", "of at most 1000 characters"),
}
BOMB = 100_000
CONTENTS = {
    "empty": (b"", "name is missing: add the key"),
    "blank": (b"\n\n# nothing\n", "name is missing: add the key"),
    "garbage": (b"\x00\xff garbage" * 1_000_000, f"larger than {FILE_SIZE_MAX} bytes"),
    "binary": (bytes(range(256)), "not a TOML file ('utf-8' codec"),
    "not UTF-8": (
        EXAMPLE.replace("strikes", "schlägt").encode("latin-1"),
        "not a TOML file ('utf-8",
    ),
    "UTF-16": (EXAMPLE.encode("utf-16"), "not a TOML file ('utf-8' codec"),
    "zip": (b"PK\x03\x04\x14\x00", "not a TOML file ("),
    "JSON": (b'{"name": "x"}', "not a TOML file (Invalid statement (at line 1, column 1))"),
    "value instead of a table": (b"release = 3", "line 1: release = 3: write [release]"),
    "half a line": (
        b'name = "x"\ntitle = \n',
        "not a TOML file (Invalid value (at line 2, column 9)): title =",
    ),
    "quantity without quotes": (
        b'name = "x"\nposition = 5 mm\n',
        "(at line 2, column 14)): position = 5 mm; write texts, and numbers with a unit, in "
        'quotes, for instance "5 mm"',
    ),
    "text without quotes": (
        b"model = beam",
        "(Invalid value (at line 1, column 9)): model = beam; write texts, and numbers with",
    ),
    "point without quotes": (
        b"foot = [5 mm, 0]",
        "(Unclosed array (at line 1, column 11)): foot = [5 mm, 0]; write texts, and numbers with",
    ),
    "text with one quote": (b'name = "x\na = 1', '): name = "x'),
    "line of many characters": (b"a = 1\0" * BOMB, "a = 1 a = 1 a = 1"),
    "bomb of lists": (b"x = " + b"[" * BOMB + b"]" * BOMB, "are nested too deeply"),
    "bomb of tables": (b"x = " + b"{a=" * BOMB + b"1" + b"}" * BOMB, "are nested too deeply"),
    "bomb of keys": (b"a." * BOMB + b"a = 1", "are nested too deeply"),
    "bomb of a header": (b"[" + b"a." * BOMB + b"a]", "are nested too deeply"),
    "deep key": (b"a." * 90 + b"a = 1", "line 1: unknown key a; allowed keys"),
    "bomb as a value": (
        b"release = " + b"[" * 300 + b"]" * 300,
        "release = [[[[[[[...]]]]]]]: write",
    ),
    "many mistakes": (b"[[bodies]]\n" * 5_000, "bodies.0.name is missing"),
}
