"""Rules, sentences and verdicts of a ledger: each can be passed and failed."""

import math

import pytest

from asperity import materials
from asperity.errors import InputError
from asperity.ledger import Contents, check, fill, judge_claims, printed_numbers, rules
from asperity.ledger.claims import computed_numbers, formula_verdict, judge
from asperity.ledger.contents import About, Entry, RuleWords
from asperity.ledger.sentences import names_in

ABOUT = About(title="x", authors="x", journal="x", short="x", numbers="bureau2000")
NUMBERS = materials.load("bureau2000")


def entry(accept="about", kind="test", depends_on=(), judged=(), computed="x", **rule):
    blanks = dict.fromkeys(["id", "place", "statement", "stated", "how", "why"], "x")
    blanks |= {"judged": judged, "computed": computed}
    words = RuleWords(accept=accept, **rule)
    return Entry(**blanks, kind=kind, rule=words, depends_on=depends_on)


@pytest.mark.parametrize(
    ("rule", "good", "bad"),
    [
        (rules.rounds_to(0.48, 0.01), [0.475, 0.48, 0.485], [0.4749, 0.4851]),
        (rules.about(20.0), [19.0, 21.0], [18.9, 21.1]),
        (rules.about(-20.0), [-19.0], [19.0, -18.9]),
        (rules.of_order(1e-3), [3.2e-4, 3.1e-3], [3.1e-4, 3.2e-3, -1e-3, 0.0]),
        (rules.of_order(-1e-3), [-3.2e-4], [-3.1e-4, 1e-3, 0.0]),
        (rules.of_order(0.0), [], [0.0, 1.0]),
        (rules.below(0.1, "x"), [0.0, -1.0, 0.09], [0.1, 1.0]),
        (rules.above(10, "x"), [10.1], [10.0, -11.0]),
        (rules.between(0.1, 0.2, "x"), [0.1, 0.2], [0.0999, 0.2001]),
        (rules.change_below(0.05, "x"), [0.049, -0.049], [0.05, -0.05]),
    ],
)
def test_a_rule_accepts_and_refuses(rule, good, bad):
    assert all(rule.holds(value) for value in good)
    assert not any(rule.holds(value) for value in [*bad, math.nan, math.inf, -math.inf])
    assert rule.text


def test_one_wrong_number_among_several_is_enough():
    def verdict(numbers):
        return judge(entry(stated=1.0), numbers, {}).verdict

    assert verdict({"a": 1.0, "b": 1.01}) == "reproduced"
    assert verdict({"a": 1.0, "b": 1.1}) == "differs"
    assert verdict({}) == "differs"


def test_a_rule_takes_words_and_printed_numbers():
    outcome = {"x": 0.06}
    assert judge(entry("change-below", limit="negligible"), outcome, {}).verdict == "differs"
    assert judge(entry("change-below", limit="weak"), outcome, {}).verdict == "reproduced"
    assert judge(entry(stated="A"), outcome, {"A": 0.06}).verdict == "reproduced"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (entry("abou", stated=1.0), "rule.accept must be a rule .* did you mean 'about'"),
        (entry("about"), "rule.stated must be given"),
        (entry("below", limit="weekly"), "rule.limit must be a number, a word .* 'weekly'"),
        (entry("formula", tolerance=0.01), "must have the numbers 'printed' and 'independent'"),
    ],
)
def test_a_rule_that_cannot_be_built_is_refused(words, message):
    with pytest.raises(InputError, match=message):
        judge(words, {"x": 1.0}, {})


@pytest.mark.parametrize(
    ("printed", "derived", "verdict"),
    [
        (1.0, 1.0, "reproduced"),
        (1.0, 2.0, "reproduced"),
        (2.0, 1.0, "misprint"),
        (2.0, 3.0, "differs"),
        (-1.0, 1.0, "misprint"),
        (2.0, math.nan, "differs"),
        (math.nan, 1.0, "misprint"),
    ],
)
def test_a_formula_is_decided_by_the_independent_number(printed, derived, verdict):
    assert formula_verdict(printed, derived, 1.0, 0.01) == verdict
    numbers = {"printed": printed, "derived": derived, "independent": 1.0}
    finite = {name: value for name, value in numbers.items() if math.isfinite(value)}
    if "printed" in finite:
        assert judge(entry("formula", tolerance=0.01), finite, {}).verdict == verdict
    assert formula_verdict(printed, derived, math.nan, 0.01) == "differs"


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("a/b.high - 2*lambda_**2", 6 / 4 - 2 * 25),
        ("sqrt(a + 3)*ln(b.high)/pi", 3 * math.log(4) / math.pi),
    ],
)
def test_a_formula_of_printed_numbers(formula, expected):
    numbers = {"a": 6.0, "b.high": 4.0, "lambda": 5.0}
    assert rules.formula_value(formula, numbers, "x") == pytest.approx(expected, rel=1e-15)


def test_a_list_of_one_number_is_its_first_and_its_last():
    one = NUMBERS["V_data"].model_copy(update={"values": (3.0,)})
    numbers = NUMBERS.model_copy(update={"numbers": {"V_data": one}})
    assert printed_numbers(numbers) == {"V_data.first": 3e-6, "V_data.last": 3e-6}


def test_a_formula_names_terms_of_the_model():
    terms = {"law": {"n": 2.0}, "power": lambda law, x: x ** law["n"], "slow": 3}
    value = rules.formula_value("-abs(power(law, slow) - a)", {"a": 10.0}, "x", terms)
    assert value == -1.0
    for wrong in (
        "power(law)",
        "power",
        "law",
        "power(a, slow)",
        "power(law, slow).n",
        "(slow)[0]",
    ):
        with pytest.raises(InputError, match=r"x must be a (formula|number)"):
            rules.formula_value(wrong, {"a": 10.0}, "x", terms)


def test_functions_of_formulas():
    terms = {"z": lambda: 3.0 - 4.0j, "row": lambda: [2.0, 5.0]}
    for formula, value in (
        ("abs(z())", 5.0),
        ("real(z()) - imag(z())", 7.0),
        ("min(a, 1) + max(row())", 6.0),
        ("sqrt(a)*ln(a)", 2.0 * math.log(4.0)),
    ):
        assert rules.formula_value(formula, {"a": 4.0}, "x", terms) == value


def test_a_formula_names_the_values_before_it():
    """A printed number of the same name goes first."""
    formulas = {"half": "K/2", "K": "2*half", "twice": "K + half"}
    made = entry(stated=1.0).model_copy(update={"values": formulas})
    K = NUMBERS.K
    assert computed_numbers(made, {}, None, NUMBERS) == {"half": K / 2, "K": K, "twice": 1.5 * K}
    backwards = made.model_copy(update={"values": {"b": "half", "half": "K/2"}})
    with pytest.raises(InputError, match=r"x\.values\.b must be a number"):
        computed_numbers(backwards, {}, None, NUMBERS)


@pytest.mark.parametrize("formula", ["a b", "__import__('os')", "a.b", "1/0", "[a]", "ln(0)", ""])
def test_what_is_no_formula_of_printed_numbers_is_refused(formula):
    with pytest.raises(InputError, match=r"x.values must be a (formula|number)"):
        rules.formula_value(formula, {"a": 1.0}, "x.values")


def test_claims_and_checks_belong_together():
    @check("no-such-claim")
    def computed(model):
        return {"x": 1.0}

    with pytest.raises(InputError, match="none for 'no-such-claim'"):
        judge_claims(
            Contents(paper=ABOUT),
            {"no-such-claim": computed},
            NUMBERS,
            lambda numbers: numbers,
        )
    with pytest.raises(InputError, match="checks must compute every claim"):
        judge_claims(
            Contents(paper=ABOUT, claim=(entry(stated=1.0),)), {}, NUMBERS, lambda numbers: numbers
        )


def test_only_what_is_judged_is_judged():
    numbers = {"a, 1 um/s": 1.0, "a, 10 um/s": 1.01, "shown": 7.0, "words": "of order one"}
    claim = judge(entry(stated=1.0, judged=("a, *",), computed="{words}: {shown:g}"), numbers, {})
    assert claim.verdict == "reproduced"
    assert list(claim.numbers) == ["a, 1 um/s", "a, 10 um/s"]
    assert claim.computed == "of order one: 7"
    assert judge(entry(stated=1.0), numbers, {}).verdict == "differs"


@pytest.mark.parametrize(
    ("words", "numbers", "message"),
    [
        (entry(stated=1.0, judged=("b",)), {"a": 1.0}, r"x.judged must name numbers .*got 'b'"),
        (entry(stated=1.0, computed="{b:g}"), {"a": 1.0}, r"x.computed must quote .*got '\{b\}'"),
        (entry(stated=1.0, computed="{a:"), {"a": 1.0}, "x.computed must be a sentence"),
        (entry(stated=1.0), {"a": math.inf}, "must compute finite numbers, got inf for 'a'"),
        (entry(stated=1.0), ({}, "x"), "must be a function that returns numbers by name"),
    ],
)
def test_words_and_numbers_that_do_not_fit_are_refused(words, numbers, message):
    with pytest.raises(InputError, match=message):
        judge(words, numbers, {})


@pytest.mark.parametrize(
    ("sentence", "text"),
    [
        ("{mu1, 10 um/s:.3g} there", "0.00195 there"),
        ("{1e3*mu1, 10 um/s:.2f}e-3", "1.95e-3"),
        ("{-100*a/b:+.1f} %", "-50.0 %"),
        ("{eps = 0.5:.0%}, {word}", "12%, yes"),
        ("{{as it is}}", "{as it is}"),
    ],
)
def test_a_sentence_with_its_numbers(sentence, text):
    values = {"mu1, 10 um/s": 1.95e-3, "a/b": 0.5, "eps = 0.5": 0.12, "word": "yes"}
    assert fill(sentence, values, "x") == text
    assert set(names_in(sentence)) <= set(values)
