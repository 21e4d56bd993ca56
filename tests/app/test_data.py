"""Data: files that are sent, what is measured of them, fits, and the virtual tribometer."""

import base64
import gzip
import io
import shlex
import zipfile
from pathlib import Path
from statistics import NormalDist
from urllib.parse import unquote

import numpy as np
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.app.api import fits, recordings
from asperity.app.api.protocols import checked
from asperity.app.uploads import Uploads
from asperity.app.words import in_labels
from asperity.cli.main import main
from asperity.errors import Argument, InputError, naming, symbol
from asperity.inference.answers import read_data
from asperity.laws.registry import symbols_of
from asperity.outputs.sections import Section
from asperity.questions import fit as questions, recording as questions_of_recordings
from references.spring_slider import spring_slider

MU1, PHASE1 = 0.012, -0.4


@pytest.fixture(scope="module")
def modulated():
    """A recording with known harmonics, as CSV: F/W0 = 0.5 + MU1 cos(phi + PHASE1) + noise."""
    rng = np.random.default_rng(3)
    t = np.arange(6000) / 1000.0
    phi = 2 * np.pi * 20.0 * t
    load = 7 * (1 + 0.2 * np.cos(phi))
    force = 7 * (0.5 + MU1 * np.cos(phi + PHASE1)) + 1e-3 * rng.normal(size=t.size)
    rows = np.column_stack([t, load, force])
    lines = [",".join(f"{v:.7g}" for v in row) for row in rows]
    return ("time (s),Fn (N),Ft (N)\n" + "\n".join(lines) + "\n").encode()


@pytest.fixture
def send(ask):
    """Send a file; the answer of the server."""

    def to_server(content, name="recording.csv", **headers):
        own = {"Content-Type": "application/octet-stream", "X-File-Name": name}
        return ask("data/upload", content, headers=own | headers)

    return to_server


@pytest.fixture
def measured_here(tmp_path):
    """Measure a file in this process, as a process of the server does; what it sends."""

    def of(content, name="mine.csv", source=None, options=None):
        path = tmp_path / "0123.csv"
        path.write_bytes(content)
        source = recordings.Source.model_validate(source or {}).model_dump()
        argument = {"path": str(path), "name": name, "source": source, "options": options or {}}
        sent = []
        result = recordings.measure(argument, lambda **message: sent.append(message))
        return [*sent, {"result": result}]

    return of


@pytest.fixture
def measured(ask, send):
    """Send a file and measure it; the messages of the server."""

    def of(content, name="recording.csv", **asked):
        key = send(content, name).json["id"]
        return ask("data/measure", {"recording": key, **asked}).lines

    return of


def test_a_recording_is_measured_as_the_package_does(measured, modulated, tmp_path):
    *_, understood, _, last = measured(modulated, "a.csv")
    channels = {c["name"]: c for c in understood["recording"]["channels"]}
    assert {n: c["unit"] for n, c in channels.items()} == {"Fn": "N", "Ft": "N"}
    assert understood["recording"]["roles"]["W"] == "Fn"
    record = last["result"]["measured"]["record"]
    assert record["mu1"] == pytest.approx(MU1, rel=0.01)
    assert record["phase1"] == pytest.approx(PHASE1, abs=0.01)
    (tmp_path / "a.csv").write_bytes(modulated)
    direct = asp.measure(tmp_path / "a.csv")
    assert record["mu1"] == pytest.approx(abs(direct.reading.harmonics[0]), rel=1e-12)
    assert record["verdict"] == direct.verdict
    assert len(last["result"]["measured"]["curves"]["force"]["x"]) <= 1402


def test_columns_and_units_are_corrected_by_hand(measured_here, modulated):
    swapped = {"columns": {"W": "Ft", "F": "Fn"}, "units": {"Fn": "kN", "Ft": "kN"}}
    lines = measured_here(modulated, source=swapped, options={"modulated": True})
    recording = next(m["recording"] for m in lines if "recording" in m)
    assert recording["roles"]["W"] == "Ft"
    assert recording["channels"][0]["mean"] == pytest.approx(7e3, rel=1e-3)
    assert "--load Ft" in lines[-1]["result"]["command"]


@pytest.fixture(scope="module")
def sawtooth():
    """Stick-slip of 30 cycles, as CSV: F/W rises for 0.9 s and falls by DROP in 0.1 s."""
    phase = (np.arange(15000) / 500.0) % 1.0
    fall = DROP * (1 + np.cos(np.pi * (phase - 0.9) / 0.1)) / 2
    friction = 0.4 + np.where(phase < 0.9, DROP * phase / 0.9, fall)
    friction = friction + 1e-3 * np.random.default_rng(5).normal(size=phase.size)
    rows = (f"{k / 500.0:.7g},{mu:.7g}" for k, mu in enumerate(friction))
    return ("time (s),friction\n" + "\n".join(rows) + "\n").encode()


DROP = 0.08


def test_stick_slip_is_recognised_and_its_events_are_counted(measured_here, sawtooth):
    last = measured_here(sawtooth, "events.csv")[-1]["result"]
    record = last["measured"]["record"]
    assert record["mode"] == "stick-slip"
    assert record["regime"] == "regular stick-slip"
    # The last fall ends with the recording.
    assert record["events"] in (29, 30)
    assert record["drop"] == pytest.approx(DROP, rel=0.02)
    assert record["stick_duration"] == pytest.approx(0.9, rel=0.03)
    assert last["command"] == "asperity measure events.csv --stick-slip"
    # The spring of 168 N/m is loaded by DROP * 0.3 N in 0.9 s, and the slip takes 0.1 s.
    velocity = DROP * 0.3 / 168 / 0.9
    options = {"stick_slip": True, "stiffness": "168 N/m", "normal_load": 0.3, "velocity": velocity}
    machine = measured_here(sawtooth, "events.csv", options=options)[-1]["result"]
    assert "--set 'K=168.0 N/m'" in machine["command"]
    assert "--set 'W0=0.3 N'" in machine["command"]
    slip = velocity * 1.0
    assert machine["measured"]["record"]["catalogue"][3]["slip"] == pytest.approx(slip, rel=0.1)


def test_channels_without_a_finite_value_do_not_matter(measured_here, modulated):
    """A recorder writes columns of inputs to which nothing is connected."""
    draw = np.random.default_rng(2)
    lines = modulated.decode().splitlines()
    spare = draw.integers(1, 30)
    places = draw.integers(0, 4, spare)
    words = draw.choice(["nan", "", "inf", "-inf", "NaN"], spare)
    head, *rows = [line.split(",") for line in lines]
    for k, (place, word) in enumerate(zip(places, words, strict=True)):
        head.insert(place, f"spare {k} (V)")
        for row in rows:
            row.insert(place, word)
    content = "\n".join(",".join(row) for row in [head, *rows]) + "\n"
    source = {"columns": {"time": "time", "W": "Fn", "F": "Ft"}}
    sent = measured_here(content.encode(), source=source)
    assert sent[-1]["result"]["measured"]["record"]["mu1"] == pytest.approx(MU1, rel=0.01)
    channels = next(m["recording"]["channels"] for m in sent if "recording" in m)
    assert sum(c["not_finite"] == 6000 for c in channels) == spare
    assert {c["name"] for c in channels if "mean" in c} == {"Fn", "Ft"}


@pytest.mark.parametrize(
    "name",
    [
        "../../../etc/passwd",
        "..\\..\\passwd",
        "%2e%2e%2fpasswd",
        "/etc/passwd",
        "a\x7f/passwd",
        "a -> /etc/passwd",
    ],
)
def test_no_name_becomes_a_path(send, name, tmp_path):
    before = Path("/etc/passwd").read_bytes()
    answer = send(b"1,2\n", name)
    assert answer.json["name"] == "passwd"
    assert answer.json["size"] == 4
    assert Path("/etc/passwd").read_bytes() == before


def test_files_lie_under_names_of_the_server_and_are_deleted():
    uploads = Uploads()
    kept = [uploads.begin(name) for name in ("../../x.csv", "a.h5", "b.exe", "")]
    for upload in kept:
        upload.path.write_bytes(b"1")
    (folder,) = {upload.path.parent for upload in kept}
    assert [u.path.suffix for u in kept] == [".csv", ".h5", "", ""]
    assert sorted(p.name for p in folder.iterdir()) == sorted(u.path.name for u in kept)
    assert uploads.get(kept[1].key).name == "a.h5"
    uploads.close()
    assert not folder.exists()


def packed(zeros):
    """An archive that unpacks to so many MB."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", b"\0" * (zeros * 2**20))
    return file.getvalue()


#: Each is made by its test alone: some are of megabytes.
HOSTILE = {
    "empty": lambda: b"",
    "zip": lambda: b"PK\x03\x04" + b"\0" * 1000,
    "hdf5 garbage": lambda: b"\x89HDF\r\n\x1a\n" + bytes(range(256)) * 8,
    "gzip cut": lambda: gzip.compress(b"1,2\n" * 10_000)[:-30],
    "no numbers": lambda: b"time,load,force\n" + b"nan,nan,nan\n" * 200,
    "binary": lambda: bytes(range(256)) * 40,
    "words": lambda: b"hello world, this is a text\n" * 50,
    "matlab garbage": lambda: b"MATLAB 5.0 MAT-file" + b"\xff" * 500,
    "tdms garbage": lambda: b"TDSm" + b"\xff" * 500,
    "a cell without end": lambda: b"time,load,force\n" + b"9" * 100_000,
    "json that is no reading": lambda: b'{"mode": [' * 50,
    "json without end": lambda: b"[" * 100_000,
    "a million columns": lambda: (
        b",".join(b"c%d" % i for i in range(10**6)) + b"\n" + b"1," * 10**6
    ),
    "a line without end": lambda: b"1" * 10**7,
    "an archive of zeros": lambda: packed(zeros=50),
    "zeros": lambda: gzip.compress(b"\0" * 10**7),
    "code in numpy's file": lambda: (
        b"\x93NUMPY\x01\x00v\x00{'descr': '|O'}\n\x80\x04cos\nsystem\n."
    ),
    "code in a pickle": lambda: b"\x80\x04cos\nsystem\n(X\x02\x00\x00\x00lstR.",
}


@pytest.mark.parametrize("what", HOSTILE)
def test_what_is_no_recording_gets_a_sentence(measured_here, what, tmp_path):
    """What the process does that reads a file."""
    with pytest.raises(InputError, match=" must ") as refused:
        measured_here(HOSTILE[what]())
    assert str(tmp_path) not in str(refused.value)
    assert "0123" not in str(refused.value)


@pytest.mark.parametrize(
    ("content", "source", "begin"),
    [
        (b"a,b\n" + b"1,2\n" * 300, {}, "Time column must be a column"),
        (b"time,b\n" + b"1,2\n" * 300, {"rate": "1 kg"}, "Sampling rate must"),
        (b"time (s),Ft (N)\n0,1\n1,2\n2,3\n3,3\n", {}, "Friction must name the friction"),
        (b"PK\x03\x04" + b"\0" * 300, {}, "The recording must be"),
    ],
)
def test_a_sentence_names_what_the_page_names(measured_here, content, source, begin):
    with pytest.raises(InputError) as refused:
        measured_here(content, source=source)
    with naming(in_labels):
        sentence = str(refused.value)
    assert sentence.startswith(begin)
    assert "columns=" not in sentence
    assert "columns[" not in sentence


def test_the_sentence_of_a_file_reaches_the_page(measured):
    *_, last = measured(HOSTILE["hdf5 garbage"](), "garbage.h5")
    assert last["done"]
    assert "garbage.h5" in last["error"]
    assert " must " in last["error"]


def test_a_file_that_is_too_large_is_refused(raw, server):
    host = f"Host: 127.0.0.1:{server.port}\r\n"
    head = f"POST /api/data/measure HTTP/1.1\r\n{host}Content-Type: application/json\r\n"
    assert "413" in raw(f"{head}Content-Length: 100000\r\n\r\n".encode())
    head = f"POST /api/data/upload HTTP/1.1\r\n{host}Content-Type: application/octet-stream\r\n"
    assert "413" in raw(f"{head}Content-Length: 10000000000\r\n\r\n".encode())


def test_a_form_of_another_site_cannot_send_a_file(send):
    assert send(b"1,2", **{"Content-Type": "text/plain"}).status == 400
    assert send(b"1,2", Origin="http://evil.example").status == 403


@pytest.mark.parametrize("key", ["", "../x", "/etc/passwd", "0" * 32, "x" * 61])
def test_only_files_that_were_sent_are_read(ask, key):
    answer = ask("data/measure", {"recording": key})
    assert answer.status == 400
    assert " must " in answer.json["error"]


PROTOCOL = """
law = "elasto-plastic"
material = "bureau2000"
steps = ["slide for 0.2 s", {step}]
[start]
velocity = "10 um/s"
{more}
"""


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (PROTOCOL.format(step='"hold 10 kg"', more=""), 4, "step 2"),
        (PROTOCOL.format(step='"follow load from /etc/passwd"', more=""), 4, "file"),
        (PROTOCOL.format(step='"hold 1 s"', more='[solver]\nsampling = "2 kg"'), 8, "sampling"),
        (PROTOCOL.format(step="", more="x = = 3"), 7, "TOML"),
        (PROTOCOL.replace("bureau2000", "../x.toml").format(step="", more=""), 3, "material"),
        (PROTOCOL.replace("elasto-plastic", "f.py:Law").format(step="", more=""), 2, "law"),
        ('folder = "/etc"\n', 1, "folder"),
    ],
)
def test_a_mistake_of_a_protocol_has_a_sentence_and_a_line(text, line, word):
    mistake = checked(text)[1][0]
    assert mistake["line"] == line
    assert word in mistake["sentence"]
    assert " must " in mistake["sentence"]


def test_the_recording_of_a_protocol_is_measured(ask):
    text = PROTOCOL.format(step='"hold 0.1 s"', more='[solver]\nsampling = "1 kHz"')
    result = ask("data/run", {"text": text}).lines[-1]["result"]
    assert result["stopped"] is None
    assert result["curves"]["load"]["y"][0] == pytest.approx(asp.materials.load("bureau2000").W0)
    (*_, last) = ask("data/measure", {"recording": result["id"]}).lines
    assert last["result"]["measured"]["record"]["mode"] == "sliding"


TABLE = """V,epsilon,frequency,mean_friction,mean_friction_err
1e-6,1e-4,120,0.490,0.001
2e-6,1e-4,120,0.481,0.001
3e-6,1e-4,120,0.476,0.001
"""


def test_the_report_of_a_fit_is_packed_whole(monkeypatch):
    def written(folder, fit, posterior, names):
        folder.mkdir()
        (folder / "fit.json").write_text(f"{fit} fitted")

    monkeypatch.setattr("asperity.fit_report.write_report", written)
    packed = fits._report("a law", None, "friction")
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(packed))) as folder:
        texts = {name: folder.read(name).decode() for name in folder.namelist()}
    assert texts == {"report/fit.json": "a law fitted"}


class Drawn:
    """A posterior whose draws are known: 2 chains of 100 quantiles of a normal distribution."""

    log_density = np.zeros((2, 100))

    def __init__(self, fit, seed):
        quantiles = [NormalDist().inv_cdf((k + 0.5) / 200) for k in range(200)]
        p = fit.parameters["mu0"]
        self.draws = {"mu0": p.value + p.se * np.reshape(quantiles, (2, 100))}
        self.seed = seed

    def record(self):
        return {"seed": self.seed, "converged": True}

    def to_netcdf(self, path):
        Path(path).write_bytes(b"draws")


def test_a_table_of_a_spreadsheet_is_shown_without_its_row_of_units(measured_here):
    lines = "Tag;V;epsilon;mu1;", ";µm/s;%;-;", "1.2.;1,5;24;0,002;", "2.2.;2;24;0,0021;"
    table = measured_here("\r\n".join(lines).encode("cp1252"), "t.csv")[-1]["result"]["table"]
    assert table["header"] == ["Tag", "V (µm/s)", "epsilon (%)", "mu1", ""]
    assert table["rows"] == [["1.2.", "1.5", "24", "0.002", ""], ["2.2.", "2", "24", "0.0021", ""]]
    assert table["count"] == 2
    assert table["text"] == "\r\n".join(lines)


def test_a_table_is_fitted_and_its_posterior_sampled_as_asked(measured_here, monkeypatch):
    """Hardly modulated, the mean friction is mu0 + (A - B) ln(V/V0)."""
    table = measured_here(TABLE.encode(), "readings.csv")[-1]["result"]["table"]
    assert table["count"] == 3

    def sampled(fit, *, chains, draws, seed, progress):
        assert (chains, draws, seed) == (2, 100, 7)
        progress(50, 800)
        return Drawn(fit, seed)

    monkeypatch.setattr("asperity.inference.sample_posterior", sampled)
    monkeypatch.setattr(
        "asperity.fit_report.write_report",
        lambda folder, fit, posterior, names: (
            folder.mkdir() or posterior.to_netcdf(folder / "a.nc")
        ),
    )
    monkeypatch.setattr(
        "asperity.inference.report.posterior_sections",
        lambda posterior: [Section("A", (f"{symbol('A')} is larger than {symbol('B')}",))],
    )
    asked = {
        "laws": ["rice-ruina"], "free": ["mu0"], "material": "bureau2000", "report": True,
        "names": "geophysics", "tables": [{"name": "readings.csv", "text": table["text"]}],
        "posterior": True, "chains": 2, "draws": 100, "seed": 7,
    }  # fmt: skip
    sent = []
    whole = {"question": fits.Fitted.model_validate(asked).model_dump(), "files": []}
    result = fits.fit(whole, lambda **message: sent.append(message))
    assert {"draws": 50, "of": 800} in sent
    assert result["posterior"]["seed"] == 7
    assert result["sections"][-1]["title"] == "A"  # a text of the report, and no parameter
    assert result["sections"][-1]["sentences"] == ("a is larger than b",)
    middles, heights = (np.array(result["posterior"]["histograms"]["mu0"][n]) for n in "xy")
    width = middles[1] - middles[0]
    mu0 = result["fit"]["parameters"]["mu0"]
    p = asp.materials.load("bureau2000")
    V = np.array([1e-6, 2e-6, 3e-6])
    expected = np.mean([0.490, 0.481, 0.476] - (p.A - p.B) * np.log(V / p.V0))
    assert mu0["value"] == pytest.approx(expected, abs=1e-6)
    assert mu0["se"] == pytest.approx(0.001 / np.sqrt(3), rel=1e-4)
    assert heights.sum() * width == pytest.approx(1)
    assert (heights * middles).sum() * width == pytest.approx(mu0["value"], abs=0.1 * width)
    assert "--free mu0" in result["command"]
    assert "--posterior --chains 2 --draws 100 --seed 7" in result["command"]
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(result["report"]))) as folder:
        assert folder.read("report/a.nc") == b"draws"
    # Hardly modulated, the mean does not depend on the amplitude: the band is mu0's own interval.
    slow = result["bands"][0]["rows"][0]["series"][0]
    assert slow["at"] == [1e-4]
    assert slow["value"] == [0.49]
    half = (slow["high"][-1] - slow["low"][-1]) / 2
    assert half == pytest.approx(1.96 * mu0["se"], rel=0.15)


@pytest.mark.parametrize(
    ("changed", "word"),
    [
        ({"laws": ["rice-ruina", "nagata"], "posterior": True}, "Posterior of one law"),
        ({"draws": 99}, "Draws of each chain"),
        ({"chains": 1}, "Chains"),
        ({"draws": 10**9}, "Draws of each chain"),
        ({"laws": ["file.py:Law"]}, "law"),
        ({"material": "../x.toml"}, "material"),
        ({"tables": []}, "data"),
        ({"free": ["nonsense"]}, "Free parameters"),
        ({"fixed": {"K": "1 kg"}}, "K"),
        ({"tables": [{"name": "t.csv", "text": "no table"}]}, "t.csv"),
    ],
)
def test_a_wrong_fit_gets_a_sentence(ask, changed, word):
    asked = {
        "laws": ["rice-ruina"], "free": ["mu0"], "material": "bureau2000",
        "tables": [{"name": "t.csv", "text": TABLE}],
    }  # fmt: skip
    answer = ask("data/fit", asked | changed)
    error = answer.json["error"] if answer.status == 400 else answer.lines[-1]["error"]
    assert word in error
    assert " must " in error


def test_recordings_are_dropped_measured_and_restored_from_their_link(
    visit, barriers, modulated, sawtooth, tmp_path
):
    page = visit("#data", bypass_csp=True)
    page.locator(".drop").wait_for()
    contents = {"good.csv": modulated, "events.csv": sawtooth}
    page.set_input_files(
        "#data-files",
        [{"name": n, "mimeType": "text/csv", "buffer": content} for n, content in contents.items()],
    )
    good, events = (page.locator(f".recording[aria-label='{name}']") for name in contents)
    good.locator(".sentence", has_text="Modulated at 20 Hz by 20 %").wait_for()
    assert good.locator("figure").count() == 4
    # Tables are those of the command, with a box for each amplitude.
    parts = good.get_by_role("region", name="What was measured of good.csv").locator("tbody tr")
    assert parts.count() == 1
    mu1 = float(parts.inner_text().split("\t")[8].split()[0])
    assert mu1 == pytest.approx(MU1, rel=0.01)
    assert parts.get_by_label("Use part 1 in fits").is_checked()
    options = good.locator("summary", has_text="Channels")
    options.click()
    good.get_by_role("textbox", name="Harmonics").fill("6")
    good.get_by_role("textbox", name="Harmonics").press("Enter")
    good.locator(".panel.harmonics .bar").nth(5).wait_for()
    options.click()
    assert "against the load" in good.get_by_role("region", name="good.csv: ").inner_text()
    sentence = events.locator(".sentence", has_text="Regular stick-slip: ")
    sentence.wait_for()
    count = int(sentence.inner_text().split(": ")[1].split()[0])
    table = events.get_by_role("region", name="Catalogue of events")
    assert table.locator("tbody tr").count() == count
    assert barriers(page) == []
    assert events.locator(".panel.drops .plot .point").count() == count - 1
    with page.expect_download() as waited:
        events.get_by_role("button", name="Catalogue as CSV").click()
    waited.value.save_as(tmp_path / "events.csv")
    head, *rows = (tmp_path / "events.csv").read_text().splitlines()
    assert head.startswith("onset (s),end (s)")
    assert len(rows) == count
    plot = events.locator(".panel.whole .plot")
    plot.hover()  # when nothing moves any more
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 60, steps=4)
    page.mouse.up()
    events.get_by_role("button", name="Measure the whole recording").wait_for()
    begin, end = map(float, events.get_by_label("Window (s)").input_value().split(":"))
    assert 0 < begin < end < 30
    onsets = events.locator(".catalogue tbody td:nth-child(2)").all_inner_texts()
    assert len(onsets) < count
    assert begin <= float(onsets[0].split()[0]) <= float(onsets[-1].split()[0]) <= end
    page.get_by_role("button", name="Remove events.csv").click()
    page.wait_for_url(lambda url: "good.csv" in url and "events.csv" not in url)
    again = visit(page.url.split("/")[-1])
    # While the link is opened, a channel is given another role by hand on the first page.
    page.locator("summary", has_text="Channels").first.click()
    page.get_by_label("Role of Fn").select_option("F")
    again.locator(".sentence", has_text="Modulated at 20 Hz").wait_for()
    good.locator(".message", has_text="must").wait_for()


#: Rate-and-state friction of `steps`, of which a fit finds A, B and D0 in few iterations.
PLANTED = {"A": 0.013, "B": 0.0175, "D0": 4e-7}


@pytest.fixture(scope="module")
def stepped():
    """A recording of steps of the velocity, up tenfold and down again, of `PLANTED`, as CSV."""
    edges, rate, velocities = (0.0, 2.0, 3.0, 5.0), 40, (1e-6, 1e-5, 1e-6)
    t = np.arange(int(edges[-1] * rate)) / rate
    friction = spring_slider(velocities, edges, t, **PLANTED, k=2e4)
    friction = friction + 3e-4 * np.random.default_rng(5).normal(size=t.size)
    pulled = np.interp(t, edges, [0.0, *np.cumsum(np.diff(edges) * velocities)])
    file = io.StringIO()
    header = "time (s),displacement (m),Ft (N),Fn (N)"
    rows = np.column_stack([t, pulled, 10 * friction, np.full(t.size, 10.0)])
    np.savetxt(file, rows, delimiter=",", header=header, comments="", fmt="%.7g")
    return file.getvalue().encode()


@pytest.fixture
def steps(stepped, tmp_path):
    """The argument of a fit to `stepped`."""
    path = tmp_path / "0123.csv"
    path.write_bytes(stepped)
    asked = {
        "laws": ["rice-ruina"], "free": ["A", "B", "D0"], "material": "bureau2000",
        "runs": [{"recording": "0" * 32, "window": [0.5, 2.75]}],
    }  # fmt: skip
    return {"question": asked, "files": [{"path": str(path), "name": "steps.csv"}]}


def test_a_recording_goes_into_a_fit_as_the_package_reads_it(steps, tmp_path):
    asked = fits.Fitted(**steps["question"])
    (data,) = fits._data(asked, steps["files"], tmp_path)
    (run,) = read_data(questions.Fit(data=[data]), fits._read)
    direct = asp.inference.recorded_run(steps["files"][0]["path"], window=(0.5, 2.75))
    assert run.name == "steps"
    assert run.velocities == direct.velocities
    assert np.array_equal(run.friction, direct.friction)
    assert run.velocities == pytest.approx([1e-6, 1e-5], rel=1e-3)


def test_a_fit_of_the_page_is_copied_as_texts_that_ask_the_same(steps, monkeypatch):
    steps["question"]["runs"][0] |= {"steps": [1.5], "source": {"units": {"Fn": "N"}}}
    more = {
        "fit_rate": "2 Hz", "gauge": "50 Hz", "fixed": {"W0": "10 N"}, "drift": True,
        "prior": {"K": "0.2+-0.01 N/um"}, "trend": "quadratic",
    }  # fmt: skip
    page = fits.Fitted(**steps["question"], **more)
    texts = fits._texts(page, ["steps.csv"])
    asked = []
    monkeypatch.setattr(
        "asperity.inference.answers.answer_fit", lambda question, **_: asked.append(question)
    )
    CliRunner().invoke(main, shlex.split(texts["command"])[1:])
    exec(texts["python"], {})
    assert len(asked) == 2
    for question in asked:
        names = [*fits.FitOptions.model_fields]
        assert question.model_dump(include=names) == page.model_dump(include=names)
        assert question.law == "rice-ruina"
        (data,) = question.data
        run = page.runs[0]
        assert data.window == tuple(run.window)
        assert data.steps == tuple(run.steps)
        assert data.source.units == run.source.units


def test_a_copied_command_carries_the_units_of_numbers_in_si():
    numbers = {
        "fixed": {"K": 2e5}, "start": {"A": 0.01, "D0": 1e-6},
        "prior": {"W0": {"mean": "7 N", "std": 0.1}, "D0": {"mean": "1 um", "std": "100 nm"}},
    }  # fmt: skip
    command = fits._texts(fits.Fitted(laws=["rice-ruina"], **numbers), [])["command"]
    for option in (
        "--fix 'K=200000.0 N/m'", "--start A=0.01", "--start 'D0=1e-06 m'",
        "--prior 'W0=7+-0.1 N'", "--prior 'D0=1e-06+-1e-07 m'",
    ):  # fmt: skip
        assert option in command


def test_recordings_with_different_options_have_no_common_command():
    runs = [{"recording": key, "window": window} for key, window in (("a", "1:2"), ("b", "3:4"))]
    texts = fits._texts(fits.Fitted(laws=["rice-ruina"], runs=runs), ["a.csv", "b.csv"])
    assert texts["command"].startswith("# no command")
    assert "(3.0, 4.0)" in texts["python"]


def test_the_copied_python_of_an_open_window_runs():
    question = questions_of_recordings.Measurement(window="1:")
    text = recordings._python("a.csv", recordings.Source(area="1 cm^2"), question, modulated=True)
    imports = "\n".join(line for line in text.splitlines() if "import" in line)
    names = {}
    exec(imports, names)
    assert "window=(1.0, inf)" in text
    assert {"inf", "stress_to_force"} <= set(names)


@pytest.mark.parametrize(
    ("asked", "run", "word"),
    [
        ({"gauge": "-1 Hz"}, {}, "gauge"),
        ({"gauge": "1 kg"}, {}, "gauge"),
        ({"fit_rate": "0 Hz"}, {}, "fit_rate"),
        ({"fit_rate": "many"}, {}, "fit_rate"),
        ({"free": ["alpha"], "laws": ["linker-dieterich"]}, {}, "alpha"),
        ({}, {"velocities": ["1 um/s"]}, "velocities"),
        ({}, {"velocities": ["fast", "slow"]}, "velocities"),
        ({}, {"window": [2.75, 0.5]}, "window"),
        ({}, {"source": {"columns": {"F": "no such"}}}, "no such"),
    ],
)
def test_a_recording_that_cannot_be_fitted_gets_a_sentence(steps, asked, run, word):
    steps["question"] |= asked
    steps["question"]["runs"][0] |= run
    with pytest.raises(InputError, match=" must ") as refused:
        fits.fit(steps, lambda **message: None)
    assert word in str(refused.value)
    assert "0123" not in str(refused.value)


def test_a_recording_is_fitted_on_the_page_and_a_second_fit_cancelled(visit, barriers, stepped):
    page = visit("#data", bypass_csp=True)
    page.locator(".drop").wait_for()
    page.set_input_files(
        "#data-files",
        [{"name": "steps.csv", "mimeType": "text/csv", "buffer": stepped}],
    )
    page.get_by_label("Fit the whole recording").wait_for()
    form = page.locator(".fit-form")
    for label, on in (("elasto-plastic", False), ("rice-ruina", True)):
        form.get_by_label(label, exact=True).set_checked(on)
    for label in ("eps_ratio", "A", "B", "D0"):
        form.get_by_label(label, exact=True).set_checked(label != "eps_ratio")
    form.get_by_label("Mean values per second for long recordings").fill("full")
    fit = page.locator("section.fit")
    fit.get_by_role("button", name="Fit", exact=True).click()
    table = fit.get_by_role("region", name="Parameters")
    table.wait_for()
    rows = {row.split("\t")[0]: row.split("\t")[1] for row in table.inner_text().splitlines()[1:]}
    estimates = {name: number(rows[name]) for name in PLANTED}
    assert "nm" in table.get_by_role("row", name="D0").inner_text()
    estimates["D0"] *= 1e-9
    # 200 samples of a noise of 3e-4 leave standard errors of A, B and D0 of 0.8, 0.5 and 0.7 %.
    assert estimates == pytest.approx(PLANTED, rel=0.03)
    assert estimates["A"] - estimates["B"] == pytest.approx(PLANTED["A"] - PLANTED["B"], rel=0.02)
    lines = fit.locator(".panel.run-1 .plot path.line")
    lines.nth(2).wait_for(state="attached")  # drawn once the panel has a width
    assert lines.count() == 3
    assert not fit.get_by_role("button", name="Cancel").is_visible()
    # The numbers of the fit are moved by hand, and the link restores them.
    page.locator("summary", has_text="by hand").click()
    page.locator(".by-hand .plot svg").wait_for()
    assert barriers(page) == []
    field = page.locator(".by-hand").get_by_label("memory length, with its unit")
    field.fill("0.5 um")
    field.press("Enter")
    page.wait_for_url(lambda url: '"D0":5e-7' in unquote(url))
    again = visit("#" + page.url.split("#", 1)[1])
    again.locator(".by-hand .plot svg").wait_for()
    values = "(all) => all.map((e) => e.type === 'checkbox' ? e.checked : e.value)"
    controls = ".fit-form :is(input, select, textarea), .by-hand input.number"
    first, second = (p.locator(controls).evaluate_all(values) for p in (page, again))
    assert first == second
    form.get_by_label("Intervals by profile likelihood").check()
    fit.get_by_role("button", name="Fit", exact=True).click()
    fit.get_by_role("button", name="Cancel").click()
    fit.get_by_text("Cancelled.").wait_for()
    # Priors without a material would have no effect.
    form.get_by_label("Published uncertainties as priors").check()
    fit.get_by_role("button", name="Fit", exact=True).click()
    fit.locator(".message", has_text="priors must come from a material, got none").wait_for()


def test_velocities_are_given_where_no_channel_has_the_motion(visit, barriers, stepped):
    rows = [line.split(",") for line in stepped.decode().splitlines()]
    bare = "\n".join(",".join([row[0], *row[2:]]) for row in rows)
    page = visit("#data", bypass_csp=True)
    page.locator(".drop").wait_for()
    file = {"name": "bare.csv", "mimeType": "text/csv", "buffer": bare.encode()}
    page.set_input_files("#data-files", [file])
    card = page.locator(".recording[aria-label='bare.csv']")
    card.locator(".sentence", has_text="no velocity steps").wait_for()
    card.locator("summary", has_text="Channels").click()
    for label, text in (
        ("Velocity steps (s)", "2, 3"),
        ("Velocities between steps", "1 um/s, 10 um/s, 1 um/s"),
    ):
        field = card.get_by_label(label)
        field.fill(text)
        field.press("Enter")
    card.get_by_text("Step 1 at 2 s, 1 µm/s to 10 µm/s").wait_for()
    assert barriers(page) == []
    again = visit("#" + page.url.split("#", 1)[1])
    again.locator(".sentence", has_text="2 velocity steps").wait_for()
    again.locator("summary", has_text="Channels").click()
    assert again.get_by_label("Velocities between").input_value() == "1 um/s, 10 um/s, 1 um/s"


def number(text):
    """A number as the page writes it."""
    mantissa, _, power = text.replace("−", "-").partition("·10")
    return float(mantissa) * 10.0 ** int(
        power.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")) or 0
    )


def test_a_fit_needs_a_recording_that_was_sent(ask, steps):
    answer = ask("data/fit", steps["question"])
    assert answer.status == 400
    assert "recording must be" in answer.json["error"]


def test_an_error_names_the_file_as_the_user_does_and_changes_nothing_else(measured_here) -> None:
    """The file is 0123.csv on the server."""
    rows = "".join(f"{t / 10},{3 + t % 3}\n" for t in range(60))
    with pytest.raises(InputError) as refused:
        measured_here(b"time (s),0123.csv\n" + rows.encode(), "mine.csv")
    assert refused.value.rule
    assert "0123.csv" in str(refused.value)
    assert "mine.csv" not in str(refused.value)
    with pytest.raises(InputError) as refused:
        measured_here(b"", "mine.csv")
    assert refused.value.got == "'mine.csv', which is empty"


def test_files_of_a_fit_are_named_as_the_user_does(tmp_path) -> None:
    path = tmp_path / "B.csv"
    path.write_text("A\n")
    question = {"laws": ["rice-ruina"], "runs": [{"recording": "x"}], "names": "geophysics"}
    files = [{"path": str(path), "name": "A.csv"}]
    with pytest.raises(InputError) as refused:
        fits.fit({"question": question, "files": files}, lambda **message: None)
    assert refused.value.got.startswith("'A.csv'")


def test_fixed_numbers_have_the_names_of_the_page() -> None:
    with naming(in_labels, symbols_of("geophysics")):
        assert f"{Argument('fixed', 'D0')}" == "Fixed numbers, D_c"
