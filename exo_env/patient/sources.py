"""Sources of a patient's numbers: the publications behind the labels, such as [Canning 1999], that stand in patient.py.

The same labels stand in configs/patients. A label that is nowhere in this table is a mistake, which a test finds.
"""

from __future__ import annotations

from typing import NamedTuple


class Source(NamedTuple):
    """A publication."""

    publication: str
    """Where it appeared."""
    about: str
    """What is taken from it."""
    unchecked: str = ""
    """What was not checked against the paper itself; most of the other numbers stand in the abstracts."""


SOURCES = {
    "Bazzucchi 2006": Source(
        "Muscle Nerve, doi:10.1002/mus.20462", "antagonist activity of biceps and triceps in elbow movements"
    ),
    "Bowden 2014": Source("Front. Neurol. 5:239", "elbow flexor torque and voluntary activation after stroke"),
    "Canning 1999": Source("Arch. Phys. Med. Rehabil. 80:66-70", "elbow torque after stroke, its size and its rate"),
    "Cavanagh 1979": Source("Eur. J. Appl. Physiol. 42:159-163", "electromechanical delay of the elbow flexors"),
    "Deuschl 2022": Source("Clin. Neurophysiol., doi:10.1016/j.clinph.2022.01.004", "investigation of tremor"),
    "Elble 2000": Source("Neurology 55:1547-1551", "frequency of essential tremor"),
    "Emken 2007": Source(
        "J. Neurophysiol. 97:3997-4006",
        "motor adaptation as greedy optimisation of error and effort",
        "the forgetting factors; the abstract gives the law without numbers",
    ),
    "Frey-Law 2012": Source(
        "J. Biomech. 45:1803-1808",
        "fatigue and recovery rates of six joints",
        "the elbow's rates, which lie between those of ankle and shoulder in the abstract",
    ),
    "Hammond 1955": Source("J. Physiol. 127:23P", "latency of the biceps' response to a pull", "the latency"),
    "Lance 1980": Source(
        "in Feldman, Young, Koella (eds), Spasticity: disordered motor control, 485-494", "definition of spasticity"
    ),
    "Looft 2018": Source("J. Biomech. 77:16-25", "recovery multiplier at rest"),
    "McPherson 2018": Source(
        "Exp. Brain Res. 237:121-135", "elbow stretch reflex in hemiparesis, stretches of 15 to 150 deg/s"
    ),
    "Mercier 2004": Source("Clin. Rehabil. 18:215-221", "relative strength of five muscle groups of the paretic arm"),
    "Rakshit 2021": Source(
        "doi:10.1016/j.jbiomech.2021.110695",
        "fatigue and recovery rates by muscle group and sex",
        "the rates, which are those that MyoSuite quotes from it",
    ),
    "Smith 2018": Source(
        "J. Neurophysiol., doi:10.1152/jn.00700.2017",
        "force decays while the shown error is held at zero",
        "the time constants; the abstract gives the law without numbers",
    ),
    "Wolbrecht 2008": Source(
        "IEEE Trans. Neural Syst. Rehabil. Eng. 16:286-297", "people after stroke let the robot do the work"
    ),
}
"""Sources by label, in alphabetical order."""
