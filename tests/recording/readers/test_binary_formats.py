"""HDF5, MATLAB and TDMS: the planted recording is read back, however it was written."""

from __future__ import annotations

import inspect
import sys

import h5py
import numpy as np
import pytest
import scipy.io

from asperity.errors import InputError
from asperity.recording import read

nptdms = pytest.importorskip("nptdms")


def assert_planted(trace, planted, rtol=1e-15):
    assert trace.findings == ()
    assert np.allclose(trace.time, planted.time, rtol=rtol, atol=1e-18)
    for role in ("W", "F"):
        channel = trace.channel(role)
        assert (channel.kind, channel.unit) == ("force", "N")
        assert np.allclose(channel.values, getattr(planted, role), rtol=rtol, atol=0)


# HDF5


def h5_datasets(file, planted):
    for name, values, unit in (
        ("time", planted.time * 1e3, "ms"),
        ("load", planted.W / 1e3, "kN"),
        ("shear", planted.F, "N"),
    ):
        file[name] = values
        file[name].attrs["units"] = unit


def h5_columns_of_one(file, planted):
    h5_datasets(file, planted)
    for name in ("time", "load", "shear"):
        values, unit = file[name][()], file[name].attrs["units"]
        del file[name]
        file[name] = values[:, None]
        file[name].attrs["Unit"] = np.bytes_(unit)


def h5_table(file, planted):
    table = np.zeros(planted.time.size, [("time_s", "f8"), ("W_N", "f8"), ("F_N", "f8")])
    table["time_s"], table["W_N"], table["F_N"] = planted
    file["runs/first"] = table


def h5_matrix(file, planted):
    file["data"] = np.column_stack(planted)
    file["data"].attrs["columns"] = ["Time", "Load", "Shear"]
    file["data"].attrs["units"] = ["s", "N", "N"]


def h5_wide_matrix(file, planted):
    file["data"] = np.vstack(planted)
    file["data"].attrs["channel_names"] = "Time (s), Load (N), Shear (N)"


def h5_rate(file, planted):
    file["W"], file["F"] = planted.W, planted.F
    file.attrs["sample_rate"] = 1000.0
    file["W"].attrs["unit"] = file["F"].attrs["unit"] = "N"


def h5_group(file, planted):
    group = file.create_group("experiment/run 3")
    h5_datasets(group, planted)
    file["experiment"].attrs["operator"] = "somebody"


@pytest.mark.parametrize(
    "write",
    [h5_datasets, h5_columns_of_one, h5_table, h5_matrix, h5_wide_matrix, h5_rate, h5_group],
)
def test_hdf5_is_read(tmp_path, planted, write):
    # The extension is not used.
    path = tmp_path / "recording.dat"
    with h5py.File(path, "w") as file:
        write(file, planted)
    assert_planted(read(path), planted)


def test_text_next_to_the_numbers_of_hdf5_does_not_matter(tmp_path, planted):
    path = tmp_path / "recording.h5"
    with h5py.File(path, "w") as file:
        h5_datasets(file, planted)
        file["operator"] = ["first", "second"]
        file["remark"] = "text of variable length"
    trace = read(path)
    assert np.allclose(trace.channel("W").values, planted.W, rtol=1e-15)


def test_netcdf_is_read(tmp_path, planted):
    """A trace that was written as NetCDF is read back."""
    source = tmp_path / "a.h5"
    with h5py.File(source, "w") as file:
        h5_datasets(file, planted)
    target = tmp_path / "b.nc"
    read(source).to_dataset().to_netcdf(target, engine="h5netcdf")
    assert_planted(read(target), planted)


def test_packed_netcdf_is_unpacked(tmp_path, planted):
    """Whole numbers with a factor and an offset, a fill value, and times since a date."""
    import xarray as xr

    load = np.round(planted.W, 2)
    load[7] = np.nan
    channels = {n: ("time", v, {"units": "N"}) for n, v in (("load", load), ("shear", planted.F))}
    dates = np.datetime64("2024-05-17T12:00:00") + (planted.time * 1e9).round().astype("m8[ns]")
    path = tmp_path / "a.nc"
    packed = {"dtype": "int16", "scale_factor": 0.01, "add_offset": 5.0, "_FillValue": -32768}
    times = {"dtype": "float64", "units": "minutes since 2024-05-17 12:00:00"}
    xr.Dataset(channels, {"time": dates}).to_netcdf(
        path, engine="h5netcdf", encoding={"load": packed, "time": times}
    )
    trace = read(path)
    assert [f.name for f in trace.findings] == ["missing values"]
    assert np.allclose(trace.time, planted.time, rtol=0, atol=1e-9)
    assert np.allclose(trace.channel("W").values, load, equal_nan=True)


def test_recordings_of_different_length_must_be_chosen(tmp_path, planted):
    path = tmp_path / "two.h5"
    with h5py.File(path, "w") as file:
        h5_datasets(file.create_group("fast"), planted)
        half = type(planted)(*(v[::2] for v in planted))
        h5_datasets(file.create_group("slow"), half)
    with pytest.raises(InputError, match=r"'fast' \(400 rows\), 'slow' \(200 rows\); choose one"):
        read(path)
    assert_planted(read(path, group="fast"), planted)
    assert len(read(path, group="/slow")) == 200
    with pytest.raises(InputError, match=r"read\.group must be a group.*did you mean 'slow'"):
        read(path, group="sloe")


def in_hdf5(path, runs):
    with h5py.File(path, "w") as file:
        for name, (columns, interval) in runs.items():
            group = file.create_group(name)
            group.attrs["dt"] = interval
            for label, values in columns.items():
                group[label] = values
    return path


def in_matlab(path, runs):
    structs = {name: {**columns, "dt": interval} for name, (columns, interval) in runs.items()}
    scipy.io.savemat(path, structs)
    return path


def in_tdms(path, runs):
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(name, label, values, {"wf_increment": interval})
                for name, (columns, interval) in runs.items()
                for label, values in columns.items()
            ]
        )
    return path


FORMATS = pytest.mark.parametrize("write", [in_hdf5, in_matlab, in_tdms])


@FORMATS
def test_a_chosen_group_has_its_own_interval(tmp_path, planted, write):
    runs = {"fast": ({"W": planted.W}, 1e-3), "slow": ({"W": planted.W[:200]}, 1e-2)}
    path = write(tmp_path / "two.dat.mat", runs)
    for name, (_, interval) in runs.items():
        assert read(path, group=name).time[1] == interval


@FORMATS
def test_intervals_that_differ_are_not_chosen_from(tmp_path, planted, write):
    runs = {"one": ({"W": planted.W}, 1e-3), "other": ({"F": planted.F}, 1e-2)}
    path = write(tmp_path / "two.dat.mat", runs)
    with pytest.raises(InputError, match=r"0\.001 s from 0 s on and 0\.01 s .*, none of which was"):
        read(path)
    trace = read(path, rate="1 kHz")
    assert trace.time[1] == 1e-3
    assert "several clocks" in {f.name for f in trace.findings}


@pytest.mark.parametrize("by_date", [False, True])
def test_waveforms_that_begin_at_different_times_have_no_common_clock(tmp_path, planted, by_date):
    path = tmp_path / "a.tdms"
    noon = np.datetime64("2024-05-17T12:00:00")
    with nptdms.TdmsWriter(path) as writer:
        channels = []
        for name, values, ms in (("W", planted.W, 0), ("F", planted.F, 500)):
            begins = noon + np.timedelta64(ms * by_date, "ms")
            clock = {"wf_start_offset": 0.0 if by_date else ms / 1000, "wf_start_time": begins}
            about = {"wf_increment": 1e-3, **clock}
            channels.append(nptdms.ChannelObject("run", name, values, about))
        writer.write_segment(channels)
    with pytest.raises(InputError, match=r"from 0 s on and 0\.001 s from 0\.5 s on"):
        read(path)


def test_a_table_may_have_more_columns_than_rows(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["run"] = np.array([(0.0, 5.0, 3.0), (1.0, 6.0, 4.0)], [(n, "f8") for n in "tWF"])
    assert list(read(path).channels) == ["W", "F"]


def test_a_vector_of_another_length_is_left_out_and_named(tmp_path, planted):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        h5_datasets(file, planted)
        file["calibration"] = np.arange(3.0)
    trace = read(path)
    assert [f.name for f in trace.findings] == ["other length"]
    assert list(trace.channels) == ["load", "shear"]


@pytest.mark.parametrize("part", [0.1, 0.99])
def test_hdf5_that_is_cut_is_refused(tmp_path, planted, cut, part):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        h5_datasets(file, planted)
    with pytest.raises(InputError, match=r"whole file of format .hdf5., got .cut_a.h5.,.* cut"):
        read(cut(path, part))


# MATLAB


def mat_vectors(planted):
    return {
        "t": planted.time[:, None],
        "W": planted.W,
        "F": planted.F / 1e3,
        "t_unit": "s",
        "W_units": "N",
        "F_units": "kN",
    }


def mat_struct(planted):
    units = {"time": "s", "load": "N", "shear": "N"}
    data = {"time": planted.time, "load": planted.W, "shear": planted.F, "units": units}
    return {"run": data, "operator": "somebody"}


def mat_matrix(planted):
    names = np.array(["Time (s)", "Load (N)", "Shear (N)"], dtype=object)
    return {"data": np.column_stack(planted), "names": names}


def mat_rate(planted):
    return {"W_N": planted.W, "F_N": planted.F, "fs": 1000.0}


@pytest.mark.parametrize("write", [mat_vectors, mat_struct, mat_matrix, mat_rate])
@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_5_is_read(tmp_path, planted, write, compressed):
    path = tmp_path / "recording.mat"
    scipy.io.savemat(path, write(planted), do_compression=compressed)
    assert_planted(read(path), planted)


def test_matlab_4_is_read(tmp_path, planted):
    path = tmp_path / "recording.mat"
    contents = {"t": planted.time, "W": planted.W, "F": planted.F}
    scipy.io.savemat(path, contents, format="4")
    assert_planted(read(path, units={"t": "s", "W": "N", "F": "N"}), planted)


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("compressed", [False, True])
def test_a_matlab_file_that_is_cut_is_refused(tmp_path, planted, cut, version, compressed):
    """A cut anywhere but between two variables, where nothing in the file shows it."""
    path = tmp_path / "a.mat"
    contents = {"time_s": planted.time, "W_N": planted.W, "F_N": planted.F}
    scipy.io.savemat(path, contents, format=version, do_compression=compressed and version == "5")
    for part in np.linspace(0.02, 0.995, 7):
        with pytest.raises(InputError, match=r"must be a whole file.* cut"):
            read(cut(path, part))


def matlab_73(path, planted):
    """As MATLAB writes it: a user block of 512 bytes, rows for columns, texts as numbers."""
    with h5py.File(path, "w", userblock_size=512) as file:
        run = file.create_group("run")
        run.attrs["MATLAB_class"] = np.bytes_("struct")
        units = run.create_group("units")
        units.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in zip(("time", "load", "shear"), planted, strict=True):
            run[name] = values[None, :]
            run[name].attrs["MATLAB_class"] = np.bytes_("double")
            text = "s" if name == "time" else "N"
            units[name] = np.array([[ord(c)] for c in text], dtype=np.uint16)
            units[name].attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")["a"] = np.arange(2.0)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def test_matlab_73_is_read(tmp_path, planted, cut):
    path = tmp_path / "a.mat"
    matlab_73(path, planted)
    trace = read(path)
    assert trace.provenance["format"] == "matlab 7.3"
    assert_planted(trace, planted)
    with pytest.raises(InputError, match="must be a whole file"):
        read(cut(path, 0.5))


# TDMS


def write_tdms(path, planted, segments=4, time=False, group="run"):
    clock = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        for rows in np.array_split(np.arange(planted.time.size), segments):
            channels = {"Load": (planted.W / 1e3, "kN"), "Shear": (planted.F, "N")}
            if time:
                channels = {"Time": (planted.time, "s"), **channels}
            writer.write_segment(
                [
                    nptdms.ChannelObject(
                        group,
                        name,
                        values[rows],
                        properties={"unit_string": unit, **({} if time else clock)},
                    )
                    for name, (values, unit) in channels.items()
                ]
            )
    return path


@pytest.mark.parametrize("time", [False, True])
def test_tdms_is_read(tmp_path, planted, time):
    assert_planted(read(write_tdms(tmp_path / "a.tdms", planted, time=time)), planted)


@pytest.mark.parametrize("part", [0.3, 0.5, 0.8, 0.995])
def test_tdms_that_is_cut_gives_its_whole_rows(tmp_path, planted, cut, part, caplog):
    trace = read(cut(write_tdms(tmp_path / "a.tdms", planted), part))
    assert [(f.name, f.severity) for f in trace.findings] == [("truncated", "error")]
    assert 50 < len(trace) < 400
    assert np.array_equal(trace.channel("F").values, planted.F[: len(trace)])
    assert np.allclose(trace.channel("W").values, planted.W[: len(trace)], rtol=1e-15)
    assert caplog.records == []


def test_tdms_cut_before_any_value_is_refused(tmp_path, planted, cut):
    with pytest.raises(InputError, match="must be a whole file"):
        read(cut(write_tdms(tmp_path / "a.tdms", planted), 0.02))


def test_tdms_without_its_library_is_refused(tmp_path, planted, monkeypatch):
    path = write_tdms(tmp_path / "a.tdms", planted)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(InputError, match=r"install npTDMS, as 'pip install asperity\[lab\]' does"):
        read(path)


def test_other_files_and_formats_are_refused(tmp_path):
    path = tmp_path / "picture.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20)
    with pytest.raises(InputError, match="looks like none of them"):
        read(path)
    with pytest.raises(InputError, match="must be a file"):
        read(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match=r"read.format must be a format"):
        read(path, format="png")


@pytest.mark.parametrize("way", ["link", "storage", "virtual"])
def test_hdf5_reads_no_other_file(tmp_path, way):
    """A recording sent to a server must not give access to the files of the server."""
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["F"] = np.arange(50.0)
    np.arange(50.0).tofile(tmp_path / "secret.bin")
    path = tmp_path / "sent.h5"
    with h5py.File(path, "w") as sent:
        sent["time"] = np.arange(50.0) / 10
        if way == "link":
            sent["F"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/F")
        elif way == "storage":
            outside = [(str(tmp_path / "secret.bin"), 0, 400)]
            sent.create_dataset("F", (50,), dtype="f8", external=outside)
        else:
            layout = h5py.VirtualLayout((50,), dtype="f8")
            layout[:] = h5py.VirtualSource(str(tmp_path / "secret.h5"), "F", (50,))
            sent.create_virtual_dataset("F", layout)
    with pytest.raises(InputError, match="whose 'F' lies in another file"):
        read(path)


def linked_groups(file, planted, seed):
    """The planted recording in one of many groups that have links to each other."""
    draw = np.random.default_rng(seed)
    groups = [file]
    for k in range(40):
        inside = groups[draw.integers(len(groups))] if draw.random() < 0.5 else groups[-1]
        groups.append(inside.create_group(f"group {k}"))
    h5_datasets(groups[draw.integers(1, len(groups))], planted)
    for k in range(200):
        group, target = (groups[i] for i in draw.integers(len(groups), size=2))
        group[f"link {k}"] = target if draw.random() < 0.5 else h5py.SoftLink(target.name)
    file["nowhere"] = h5py.SoftLink("/not there")


@pytest.mark.parametrize("seed", range(2))
def test_groups_with_links_to_one_another_are_read_once(tmp_path, planted, seed):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        linked_groups(file, planted, seed)
    assert_planted(read(path), planted)


def test_a_group_can_be_chosen_by_each_of_its_names(tmp_path, planted):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        h5_datasets(file.create_group("runs/fast"), planted)
        half = type(planted)(*(v[::2] for v in planted))
        h5_datasets(file.create_group("runs/slow"), half)
        file["last"], file["runs/up"] = file["runs/fast"], file["/"]
        file["best"] = h5py.SoftLink("/runs/slow")
    for name in ("last", "runs/fast", "/last/", "runs/up/last"):
        assert_planted(read(path, group=name), planted)
    assert len(read(path, group="best")) == 200


def test_groups_of_any_depth_are_read(tmp_path, planted, request):
    path, depth = tmp_path / "a.h5", 400  # twice as many as Python recurses here
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack(context=0)) + depth // 2)
    request.addfinalizer(lambda: sys.setrecursionlimit(limit))
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(depth):
            group = group.create_group("g")
        h5_datasets(group, planted)
    assert_planted(read(path), planted)
    assert_planted(read(path, group="/".join("g" * depth)), planted)


def test_matlab_cells_that_contain_themselves_are_skipped(tmp_path, planted):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w") as file:
        h5_datasets(file, planted)
        cells = [file.create_dataset(f"cell {k}", (2,), dtype=h5py.ref_dtype) for k in range(40)]
        for k, cell in enumerate(cells):
            cell.attrs["MATLAB_class"] = np.bytes_("cell")
            cell[0] = cell[1] = cells[(k + 1) % len(cells)].ref
    assert_planted(read(path), planted)
