"""The command itself: what it costs, how it helps, how it leaves."""

import importlib
import inspect
import os
import re
import signal
import subprocess
import sys
import types
import warnings

import click
import pytest

import asperity.cli.response
from asperity import __version__
from asperity.cli.main import main
from asperity.cli.options import FieldOption
from asperity.cli.shell import Shell
from asperity.questions.fit import Estimation, Fit, FitOptions
from references.commands import refused
from references.populations import population

HEAVY = ("jax", "pint", "pydantic", "scipy", "pandas", "matplotlib", "tqdm")


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, env=os.environ, check=False
    )


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["response", "--help"]])
def test_version_and_help_load_nothing_heavy(arguments: list[str]) -> None:
    script = (
        "import sys\nfrom asperity.cli.main import main\n"
        f"try:\n    main({arguments!r}, prog_name='asperity')\n"
        "except SystemExit as left:\n    assert left.code == 0\n"
        f"print('heavy:', [m for m in {HEAVY!r} if m in sys.modules])"
    )
    done = python("-c", script)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("heavy: []\n")


def test_version_does_not_load_numpy() -> None:
    script = (
        "import sys\nfrom asperity.cli.main import main\n"
        "try:\n    main(['--version'], prog_name='asperity')\n"
        "except SystemExit:\n    print('numpy' in sys.modules)"
    )
    assert python("-c", script).stdout.endswith("False\n")


@pytest.mark.parametrize("module", ["asperity", "asperity.cli.main"])
def test_it_runs_as_a_module(module: str) -> None:
    done = python("-m", module, "--version")
    assert (done.returncode, done.stdout) == (0, f"asperity, version {__version__}\n")
    assert done.stderr == ""


def test_a_mistake_in_a_real_process_is_one_line_and_exit_2() -> None:
    done = python("-m", "asperity", "response", "--law", "elasto-plastc")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "asperity: --law must be a registered law, got 'elasto-plastc'; "
        "did you mean 'elasto-plastic'?\n"
    )


def test_help_lists_the_commands_with_examples(asperity) -> None:
    for arguments in ([], ["--help"]):
        shown = asperity(*arguments)
        assert shown.exit_code == 0
        for command in ("air", "materials", "reproduce", "response"):
            assert f"\n  {command} " in shown.stdout
        assert "Examples:" in shown.stdout


@pytest.mark.parametrize("command", ["air", "materials", "reproduce", "response"])
def test_every_command_has_help_with_an_example(asperity, command: str) -> None:
    shown = asperity(command, "--help")
    assert shown.exit_code == 0
    assert f"asperity {command}" in shown.stdout.split("Example")[-1]


@pytest.mark.parametrize("command", sorted(main.modules))
def test_options_come_in_one_order(command: str) -> None:
    """What a first look needs comes first, in every command alike."""
    module = importlib.import_module(main.modules[command])
    params = getattr(module, command).params
    listed = ["--law" if "--law" in p.opts else p.opts[-1] for p in params]
    order = ["--plot", "--names", "--json", "--window", "--resume"]
    shared = [option for option in listed if option in order]
    assert shared == [option for option in order if option in shared]
    if command in ("compare", "fit", "map", "response"):
        assert listed.index("--law") < listed.index("--plot")
    assert ("--json" in listed) == ("--names" in listed)


@pytest.mark.parametrize("command", sorted(main.modules))
def test_every_option_says_what_it_does(command: str) -> None:
    called = getattr(importlib.import_module(main.modules[command]), command)
    context = click.Context(called)
    for option in called.params:
        shown = option.get_help_record(context)
        if isinstance(option, click.Option) and not option.hidden:
            assert shown is not None
            assert re.search(r"[A-Za-z]{2}", shown[1].split("[default")[0]), option.opts


def test_help_of_fields_does_not_depend_on_the_indentation_of_docstrings(monkeypatch) -> None:
    """Python 3.13 and later remove it."""
    context = click.Context(click.Command("fit"))
    option = FieldOption(["--free"], record="asperity.questions.fit:Fit")
    before = option.get_help_record(context)
    for record in (Estimation, FitOptions, Fit):
        monkeypatch.setattr(record, "__doc__", inspect.cleandoc(record.__doc__))
    assert "\nfree :" in Estimation.__doc__
    assert option.get_help_record(context) == before
    assert before[1]


def test_an_unknown_command_names_the_nearest(asperity) -> None:
    shown = asperity("materals")
    assert shown.exit_code == 2
    assert shown.stderr == (
        "asperity: command must be a known one, got 'materals'; did you mean 'materials'?\n"
    )


def test_an_interrupt_is_one_sentence_and_130(asperity, monkeypatch) -> None:
    def stop(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(asperity_response(), "_point", stop)
    shown = asperity("response")
    assert shown.exit_code == 130
    assert shown.stderr.strip() == "asperity: interrupted; nothing was written"


def asperity_response() -> types.ModuleType:
    # The package's attribute of that name is the module; the command inside it has the same name.
    return sys.modules[asperity.cli.response.__name__]


# A shell hands SIGINT on as ignored to what it runs in the background: not what is tested here.
LATE = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from asperity.cli.main import main
import asperity.cli.materials as module
module.materials.callback = lambda **_: os.kill(os.getpid(), signal.SIGINT)
main(["materials"])
"""


#: A sweep with worker processes that gets the signal while it solves.
STOPPED = """
import os, signal, sys, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from asperity.cli.main import main
import asperity.study.run as module
begin = module.solve_chunks
def solve_chunks(*arguments):
    threading.Timer(0.5, os.kill, (os.getpid(), int(sys.argv[1]))).start()
    begin(*arguments)
module.solve_chunks = solve_chunks
main(["sweep", sys.argv[2], "--out", sys.argv[3], "--workers", "1"])
"""


@pytest.mark.parametrize("number", population([signal.SIGTERM, signal.SIGINT]))
def test_a_stopped_sweep_is_one_sentence_and_leaves_no_lock(tmp_path, number) -> None:
    plan, out = tmp_path / "plan.toml", tmp_path / "s.zarr"
    plan.write_text(
        'law = "rice-ruina"\nmaterial = "bureau2000"\n'
        '[parameters]\nV = "1 um/s"\nK = "0.2 N/um"\n'
        "[axes.epsilon]\nfrom = 0.01\nto = 0.5\ncount = 2000\n"
        '[axes.frequency]\nfrom = "1 Hz"\nto = "200 Hz"\ncount = 2000\n'
    )
    done = python("-c", STOPPED, str(int(number)), str(plan), str(out))
    assert done.returncode == 130
    (line,) = done.stderr.split("\n\n")[-1].strip().splitlines()
    assert line.startswith("asperity: interrupted with ")
    assert line.endswith("the same command goes on from there")
    assert out.is_dir()
    assert not out.with_name("s.zarr.lock").exists()


def test_ctrl_c_leaves_at_once_without_a_traceback() -> None:
    done = python("-c", LATE)
    assert done.returncode == 130
    assert done.stderr == "\nasperity: interrupted; nothing was written\n"


def test_the_handler_of_the_caller_is_given_back(asperity) -> None:
    before = signal.getsignal(signal.SIGINT)
    asperity("--version")
    assert signal.getsignal(signal.SIGINT) is before


def test_a_message_with_line_breaks_stays_one_line(asperity) -> None:
    refused(asperity("response", "--law", "two\nlines"))


def test_the_commands_are_a_group_of_modules() -> None:
    group = Shell(name="x", commands={"air": "asperity.cli.air"})
    assert group.list_commands(None) == ["air"]  # type: ignore[arg-type]


def test_a_warning_is_a_line_without_a_path(monkeypatch, capsys) -> None:
    """Each text once; while tests run, a warning is an error elsewhere."""
    import click

    @click.command()
    def noisy() -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            for _ in range(2):
                warnings.warn("overflow encountered in square", RuntimeWarning, stacklevel=1)
                warnings.warn("a library\nhas its say", UserWarning, stacklevel=1)
        click.echo("answer")

    module = types.ModuleType("noisy_command")
    module.noisy = noisy  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "noisy_command", module)
    before = warnings.showwarning
    with pytest.raises(SystemExit) as left:
        Shell(name="x", commands={"noisy": "noisy_command"}).main(["noisy"])
    assert not left.value.code
    assert warnings.showwarning is before
    shown = capsys.readouterr()
    assert shown.out == "answer\n"
    assert shown.err.splitlines() == [
        "asperity: warning: a number of the computation exceeded the range of doubles "
        "(overflow encountered in square)",
        "asperity: warning: a library has its say",
    ]


@pytest.mark.parametrize("command", [(), ("sweep",)])
def test_no_line_of_a_list_of_commands_is_cut(asperity, command) -> None:
    lines = asperity(*command, "--help").stdout.splitlines()
    listed = lines[lines.index("Commands:") + 1 :]
    assert len(listed) > 5
    assert not [line for line in listed if line.rstrip().endswith("...")]
