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
    "Bennett 1993": Source(
        "Exp. Brain Res. 95:488-498, doi:10.1007/BF00227142",
        "resonant frequency of elbows that resist a step of position, 0.8 to 3.0 Hz",
    ),
    "Bowden 2014": Source("Front. Neurol. 5:239", "elbow flexor torque and voluntary activation after stroke"),
    "Calota 2008": Source(
        "Clin. Neurophysiol. 119:2329-2337, doi:10.1016/j.clinph.2008.07.215",
        "the threshold angle of the stretch reflex moves in proportion to the rate of stretch",
        "the slopes of its subjects; the law stands in reviews of it",
    ),
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
    "Gomi 1998": Source(
        "J. Neurosci. 18:8965-8978, doi:10.1523/JNEUROSCI.18-21-08965.1998",
        "stiffness of the elbow that holds a torque, roughly in proportion to it",
        "8.67 + 6.18 |torque| Nm/rad, which Tee et al. 2004, Biol. Cybern. 90:368-375, quote from it",
    ),
    "Hammond 1955": Source("J. Physiol. 127:23P", "latency of the biceps' response to a pull", "the latency"),
    "Lance 1980": Source(
        "in Feldman, Young, Koella (eds), Spasticity: disordered motor control, 485-494", "definition of spasticity"
    ),
    "Looft 2018": Source("J. Biomech. 77:16-25", "recovery multiplier at rest"),
    "Matthews 1981": Source(
        "J. Physiol. 320:1-30", "muscle spindles report length and rate", "all of it; a review of the field"
    ),
    "Matthews 1986": Source(
        "J. Physiol. 374:73-90",
        "elbow flexors: the gain of the reflex rises with the motor discharge before the stretch",
        "all of it; the title says so",
    ),
    "McPherson 2018": Source(
        "Exp. Brain Res. 237:121-135", "elbow stretch reflex in hemiparesis, stretches of 15 to 150 deg/s"
    ),
    "Mercier 2004": Source("Clin. Rehabil. 18:215-221", "relative strength of five muscle groups of the paretic arm"),
    "Miall 1993": Source(
        "J. Mot. Behav. 25:203-216, doi:10.1080/00222895.1993.9942050",
        "a forward model of the limb and of the delay, together a Smith predictor",
    ),
    "Powers 1989": Source(
        "Ann. Neurol. 25:32-42", "spastic elbow flexors: the threshold falls with the rate of stretch"
    ),
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
