"""One signal as a record in each layout that is detected."""

import numpy as np

TIME = np.arange(40) * 1e-3
SIGNAL = 5e-3 * np.cos(30.0 * TIME)


def table(delimiter=",", decimal=".", factors=(1.0, 1e3), columns=(TIME, SIGNAL), end="\n"):
    """Return rows of numbers as text."""
    rows = zip(*(f * x for f, x in zip(factors, columns, strict=True)), strict=True)
    text = end.join(delimiter.join(f"{x:.9g}" for x in row) for row in rows)
    return text.replace(".", decimal) + end


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
Operator\tlab
Date\t2015/03/04
Time\t12:00:00,5
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t40\t40\t
Date\t2015/03/04\t2015/03/04\t
Time\t12:00:00,5\t12:00:00,5\t
Y_Unit_Label\tmm\tVolts\t
X_Dimension\tTime\tTime\t
X0\t0{decimal}0000000000000000E+0\t0{decimal}0000000000000000E+0\t
Delta_X\t0{decimal}001000\t0{decimal}001000\t
***End_of_Header***\t\t\t
X_Value\tLaser\tLoad cell\tComment
"""


def lvm(decimal=".", columns="One"):
    """Return a LabVIEW measurement file of two channels, the first row with a comment."""
    rows = table("\t", decimal, (1.0, 1e3, 1.0), (TIME, SIGNAL, SIGNAL)).splitlines()
    if columns == "No":
        rows = ["\t" + row.split("\t", 1)[1] for row in rows]
    rows[0] += "\tStandby"
    return LVM.format(decimal=decimal, columns=columns) + "\n".join(rows) + "\n"


LAYOUTS = {  # name: (text, names of time and signal)
    "brackets": ("t [s],x [mm]\n" + table(), ("t", "x")),
    "parentheses": ("time (ms),x (mm)\n" + table(factors=(1e3, 1e3)), ("time", "x")),
    "slash": ("t/ms;x/um\n" + table(";", factors=(1e3, 1e6)), ("t", "x")),
    "words": ('"Time, s","x in mm"\n' + table(), ("Time", "x")),
    "decimal comma": ("t [s];x [mm]\n" + table(";", ","), ("t", "x")),
    "decimal comma, tabs": ("t [s]\tx [mm]\n" + table("\t", ","), ("t", "x")),
    "decimal comma, quoted": (
        "t [s],x [mm]\n"
        + "".join(f'"{t:.3f}","{1e3 * x:.9f}"\n' for t, x in zip(TIME, SIGNAL, strict=True))
        .replace('","', "|").replace(".", ",").replace("|", '","'),
        ("t", "x"),
    ),
    "byte order mark, CRLF": ("\ufefft [s],x [mm]\r\n" + table(end="\r\n"), ("t", "x")),
    "row of units": ("t,x\ns,mm\n" + table(), ("t", "x")),
    "row of units in brackets": ("t;x\n[s];[mm]\n\n" + table(";"), ("t", "x")),
    "PicoScope": ("Time,Channel A\n(ms),(mm)\n\n" + table(factors=(1e3, 1e3)), ("Time",
        "Channel A")),
    "PicoScope, German": (
        "Zeit;Kanal A\n(ms);(mm)\n\n" + table(";", ",", (1e3, 1e3)), ("Zeit", "Kanal A"),
    ),
    "Keysight": ("x-axis,1\nsecond,Millimeter\n" + table(), ("x-axis", "1")),
    "Tektronix": (
        "Model,MSO4034\nHorizontal Units,S\nRecord Length,40\nVertical Units,mm\n,\nTIME,CH1\n"
        + table(),
        ("TIME", "CH1"),
    ),
    "Instron": (
        '"Specimen","3"\n"Rate 1","0.5","mm/min"\n\n"Time","Extension"\n"(s)","(mm)"\n'
        + "".join(f'"{t}","{1e3 * x}"\n' for t, x in zip(TIME, SIGNAL, strict=True)),
        ("Time", "Extension"),
    ),
    "LabVIEW": (lvm(), ("time", "Laser")),
    "LabVIEW, decimal comma": (lvm(","), ("time", "Laser")),
    "LabVIEW, no X column": (lvm(columns="No"), ("time", "Laser")),
    "comments": ("# laser, 750 Hz\n% zeroed\nt [s],x [mm]\n# go\n" + table() + "# end\n", ("t",
        "x")),
    "head in a comment": ("# t [s] x [mm]\n" + table(" "), ("t", "x")),
    "aligned with blanks": ("   t[s]     x[mm]\n" + table("     "), ("t", "x")),
    "delimiter at the end": (
        "t [s];x [mm];\n" + table(";").replace("\n", ";\n"), ("t", "x"),
    ),
}  # fmt: skip
