"""Populations: distributions against scipy's, the shipped files, and every mistake by file, key and value."""

import json

import numpy as np
import pytest
from scipy import stats

from dms_core.errors import InputError
from dms_core.files.config_files import configs
from exo_env.patient.distributions import distribution, weighted
from exo_env.patient.patient import Patient
from exo_env.patient.population import Population, population, shipped_populations

SHIPPED = ("evaluation", "healthy", "mixed", "shifted", "stroke_mild", "stroke_severe", "wide")
P = (np.arange(400) + 0.5) / 400
"""Probabilities at which quantiles are compared."""
WORSE = {
    "maximum_activation_flexors": -1, "maximum_activation_extensors": -1, "strength": -1, "activation_time_scale": 1,
    "deactivation_time_scale": 1, "neural_delay": 1, "electromechanical_delay": 1, "co_contraction": 1,
    "spasticity_flexors": 1, "spasticity_extensors": 1, "stretch_threshold": -1, "tremor_amplitude": 1,
    "fatigue_rate": 1, "recovery_rate": -1, "fatigued_at_start": 1, "slacking_rate": 1, "least_effort": -1,
    "effort_recovery": -1, "feedback_gain": -1, "feedback_delay": 1,
}  # fmt: skip
"""Direction of impairment."""


@pytest.mark.parametrize(
    ("spec", "reference"),
    [
        ({"uniform": [0.3, 0.7]}, stats.uniform(0.3, 0.4)),
        ({"log_uniform": [0.001, 0.1]}, stats.loguniform(0.001, 0.1)),
        ({"normal": {"mean": 0.5, "deviation": 0.2, "low": 0.4, "high": 1.0}}, stats.truncnorm(-0.5, 2.5, 0.5, 0.2)),
    ],
)
def test_quantiles_are_those_of_scipy(spec, reference):
    d = distribution(spec)
    # Both invert smooth functions to rounding; the normal's inverse loses a few digits.
    np.testing.assert_allclose([d.quantile(p) for p in P], reference.ppf(P), rtol=1e-9)
    low, high = d.limits()
    assert (low, high) == pytest.approx(reference.support(), rel=1e-12)
    assert low <= d.quantile(0.0) and d.quantile(1.0 - 2**-53) <= high


def test_choice_and_constant():
    d = distribution({"choice": ["male", "female"], "weights": [1, 3]})
    assert [d.quantile(p) for p in (0.0, 0.2499, 0.25, 0.999)] == ["male", "male", "female", "female"]
    assert distribution({"choice": [1.0, 2.0]}).quantile(0.6) == 2.0
    assert distribution(0.4).quantile(0.9) == 0.4
    assert weighted((1.0, 0.0), 1.0) == 0


def test_seven_populations_are_shipped():
    assert shipped_populations() == SHIPPED


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_populations_give_patients(name):
    found = Population.shipped(name)
    assert found.title
    generator = np.random.default_rng(0)
    patients = [found.sample(generator) for _ in range(100)]
    assert len(set(patients)) == 100
    assert Population(**json.loads(json.dumps(found.model_dump()))) == found


@pytest.mark.parametrize("name", [n for n in SHIPPED if n != "mixed"])
def test_every_line_of_a_shipped_file_names_a_source_or_is_assumed(name):
    lines = (configs() / "patients" / f"{name}.yaml").read_text().splitlines()
    if name in ("evaluation", "shifted", "wide"):
        assert any("All ranges are assumed" in line for line in lines)
        return
    begin = lines.index("fields:")
    for before, line in zip(lines[begin:], lines[begin + 1 :], strict=False):
        if ":" in line and not line.strip().startswith("#"):
            remark = line.partition("#")[2] or before.partition("#")[2]
            assert any(word in remark for word in ("assumed", "[", "without effect", "as stroke_mild", "tremor")), line


def test_wide_spans_the_three_of_mixed_and_an_eighth_more():
    wide = Population.shipped("wide")
    assert "wide" not in Population.shipped("mixed").mixture
    for field, d in wide.distributions.items():
        if field == "sex":
            continue
        ends = [part.distributions[field].limits() for part in Population.shipped("mixed").parts]
        low, high = min(e[0] for e in ends), max(e[-1] for e in ends)
        assert d.limits()[0] <= low and high <= d.limits()[-1], field


def test_same_seed_same_patients_other_seed_others():
    found = Population.shipped("mixed")
    a, b, c = (np.random.default_rng(seed) for seed in (1, 1, 2))
    first = [found.sample(a) for _ in range(20)]
    assert first == [found.sample(b) for _ in range(20)]
    assert first != [found.sample(c) for _ in range(20)]


def test_order_in_the_file_does_not_matter():
    fields = Population.shipped("stroke_mild").fields
    turned = Population(fields=dict(reversed(fields.items())))
    assert turned.sample(np.random.default_rng(4)) == Population(fields=fields).sample(np.random.default_rng(4))


def test_mixture_by_its_weights():
    found, generator = Population.shipped("mixed"), np.random.default_rng(0)
    patients = [found.sample(generator) for _ in range(2000)]
    healthy = np.mean([p.maximum_activation_flexors > 0.92 for p in patients])
    severe = np.mean([p.spasticity_extensors >= 0.03 and p.neural_delay >= 0.05 for p in patients])
    # 2000 draws of probability 0.2: standard error 0.009, four of them. Severe are all of one part and few of another.
    assert healthy == pytest.approx(0.2, abs=0.036)
    assert severe > 0.38


def test_severity_rises_from_healthy_to_severe():
    def mean(name, field):
        d = Population.shipped(name).distributions[field]
        return np.mean([d.quantile(p) for p in P])

    for field, sign in WORSE.items():
        courses = [sign * mean(n, field) for n in ("healthy", "stroke_mild", "stroke_severe")]
        assert courses == sorted(courses), field


def test_evaluation_is_wider_and_shifted():
    evaluation, mixed = Population.shipped("evaluation"), Population.shipped("mixed")
    assert "evaluation" not in mixed.mixture
    for field, d in evaluation.distributions.items():
        parts = [part.distributions[field] for part in mixed.parts]
        if field == "sex":
            assert d.weights != parts[0].weights
            continue
        low, high = min(p.limits()[0] for p in parts), max(p.limits()[-1] for p in parts)
        assert d.limits()[0] <= low and high <= d.limits()[-1], field
        assert d.limits() != (low, high), field
        if field in WORSE:
            trained = np.average(
                [np.mean([p.quantile(x) for x in P]) for p in parts], weights=list(mixed.mixture.values())
            )
            assert WORSE[field] * (np.mean([d.quantile(x) for x in P]) - trained) > 0.0, field


def test_shifted_is_further_than_evaluation_by_its_rule():
    mixed, near, far = (Population.shipped(name) for name in ("mixed", "evaluation", "shifted"))
    assert far.distributions.keys() == near.distributions.keys()
    for field, d in far.distributions.items():
        if field == "sex":
            continue
        low, high = near.distributions[field].limits()
        assert d.limits()[0] <= low and high <= d.limits()[-1], field
        parts = np.array([[p.distributions[field].quantile(x) for x in P] for p in mixed.parts])
        weights = np.array(list(mixed.mixture.values())) / sum(mixed.mixture.values())
        mean = weights @ parts.mean(axis=1)
        deviation = np.sqrt(weights @ (parts**2).mean(axis=1) - mean**2)
        if hasattr(d, "normal"):
            # Numbers of the file have two digits, a twentieth at most; 400 quantiles leave out the ends.
            side = np.sign(near.distributions[field].normal.mean - mean)
            wanted = mean + side * deviation
            assert d.normal.mean == pytest.approx(wanted, abs=0.05 * wanted + 0.01 * deviation), field
            assert d.normal.deviation == pytest.approx(1.5 * deviation, rel=0.06), field
        else:
            assert d.limits() in ((low, 2.0 * high), (0.5 * low, high)), field


def test_body_mass_follows_height():
    fixed = {"base": "healthy", "fields": {"body_mass_index": 25.0}}
    for seed in range(5):
        patient = population(fixed).sample(np.random.default_rng(seed))
        assert patient.body_mass == pytest.approx(25.0 * patient.height**2, rel=1e-14)
    plain = population({"base": "healthy", "fields": {"body_mass": 70.0}})
    assert plain.sample(np.random.default_rng(0)).body_mass == 70.0


def test_whatever_names_a_patient():
    patient = Patient(height=1.6, maximum_activation_flexors=0.3)
    generator = np.random.default_rng(0)
    for source in (patient, {"height": 1.6, "maximum_activation_flexors": 0.3}, population(patient)):
        assert population(source).sample(generator) == patient
    assert population({}).sample(generator) == Patient()
    assert population("healthy") == Population.shipped("healthy")


def test_own_file(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("base: stroke_mild\nfields:\n  height: 1.5\n")
    found = population(str(path)).sample(np.random.default_rng(0))
    assert found.height == 1.5 and found.slacking_rate > 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fields: {height: 1.7}", "body_mass, sex, .* are missing.*base: healthy.*without 'fields'"),
        ("base: healthy\nfields: {heigth: 1.7}", "unknown key 'heigth'.*height"),
        ("base: healthy\nfields: {height: 3.0}", "height reaches 3.0"),
        ("base: healthy\nfields: {height: {uniform: [1.6, 2.9]}}", "height reaches 2.9"),
        ("base: healthy\nfields: {height: {uniform: [1.8, 1.6]}}", "height.*1.8, 1.6"),
        ("base: healthy\nfields: {height: {uniform: [1.6]}}", "height.*uniform"),
        ("base: healthy\nfields: {height: {normal: {mean: 1.7, low: 1, high: 2}}}", "height.*'deviation' is missing"),
        ("base: healthy\nfields: {height: {gamma: 2}}", "height.*expected a value or a distribution.*log_uniform"),
        ("base: healthy\nfields: {height: }", "height: expected a value or a distribution.*got None"),
        ("base: healthy\nfields: {height: .nan}", "height.*nan"),
        ("base: healthy\nfields: {height: tall}", "height reaches 'tall'"),
        ("base: healthy\nfields: {neural_delay: {log_uniform: [0.0, 0.1]}}", "neural_delay.*above 0"),
        ("base: healthy\nfields: {sex: {choice: [male, other]}}", "sex reaches 'other'"),
        ("base: healthy\nfields: {sex: {choice: [male, female], weights: [1]}}", "sex.*one number from 0"),
        ("base: healthy\nfields: {body_mass_index: 60, body_mass: 70}", "both given"),
        ("base: healthy\nfields: {body_mass_index: 90}", "body_mass_index reaches 90"),
        ("base: nobody\nfields: {height: 1.7}", "base = 'nobody': expected.*stroke_mild.*a base is no file"),
        ("base: mixed", "'mixed' is a mixture"),
        ("mixture: {healthy: 1, sick: 1}", "unknown population 'sick'.*stroke_mild"),
        ("mixture: {healthy: -1, stroke_mild: 2}", "mixture.*weights from 0"),
        ("mixture: {healthy: 1}\nfields: {height: 1.7}", "either fields"),
        ("title: nobody", "either fields"),
        ("colour: red", "unknown key 'colour'"),
        ("strength: 0.7\nfields: {height: 1.7}", "unknown key 'strength'"),
        ("strength: 70", "strength = 70"),
        ("fields: [", "not valid YAML"),
        ("height: '1.8'", "height = '1.8': Expected a number"),
        ("height: true", "height = True: Expected a number"),
        ("height: 1:30", "height = '1:30': Expected a number"),
        ("base: healthy\nfields: {height: '1.8'}", "height reaches '1.8': .*Expected a number"),
        ("base: healthy\nfields: {height: {uniform: ['1.7', 1.8]}}", "uniform.0 = '1.7': Expected a number"),
        ("base: healthy\nfields: {height: {choice: [1.7, true]}}", "choice.1"),
        ("base: healthy\nfields: {height: {choice: [1.7], weights: [.inf]}}", "weights.0 = inf: Expected a finite"),
        ("base: healthy\nfields: {height: {choice: [1.7, 1.8], weights: [1e308, 1e308]}}", "weights = .*from 0"),
        ("base: healthy\nfields: {height: {1: 2}}", "the key 1 is not text"),
        ("mixture: {healthy: '1'}", "mixture.healthy = '1': Expected a number"),
        ("mixture: {healthy: 1e308, wide: 1e308}", "mixture = .*expected weights"),
        ("self: 1", "unknown key 'self'"),
    ],
)
def test_mistakes_name_file_key_and_value(tmp_path, text, words):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=f"(?s)mine.yaml.*{words}"):
        population(str(path))


@pytest.mark.parametrize("source", ["nobody", 3, None, ["healthy"]])
def test_unknown_population_lists_the_shipped(source):
    with pytest.raises(InputError, match="evaluation, healthy, mixed, shifted, stroke_mild"):
        population(source)


def test_patient_given_as_a_mapping_is_checked():
    with pytest.raises(InputError, match="height = 9"):
        population({"height": 9.0})


def test_a_file_of_values_alone_is_one_patient(tmp_path):
    path = tmp_path / "anna.yaml"
    path.write_text("strength: 0.7\nsex: female\n")
    found = population(str(path))
    assert found.title == "anna"
    assert found.sample(1) == found.sample(2) == Patient(strength=0.7, sex="female")


def test_a_field_more_or_a_spread_more_moves_no_other_field():
    """What a stream of its own for each field is for."""
    plain = {**population("stroke_mild").fields}
    wider = {**plain, "tremor_width": {"uniform": [0.0, 5.0]}, "strength": {"uniform": [0.5, 0.6]}}
    for key in range(20):
        one, other = Population(fields=plain).sample(key), Population(fields=wider).sample(key)
        changed = {name for name in Patient.model_fields if getattr(one, name) != getattr(other, name)}
        assert changed == {"tremor_width", "strength"}


def test_what_a_patient_is_does_not_depend_on_the_mixture_it_is_drawn_from():
    mixed = population({"mixture": {"stroke_mild": 1.0, "healthy": 0.0}})
    for key in range(10):
        assert mixed.sample(key) == population("stroke_mild").sample(key)
