"""Packages of USD: read as what is in them, changed by a layer in a copy, refused where one reaches out."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from tests import servo_arm
from tests.simulator.test_sdf_file import ONE, pull
from tests.simulator.test_usd_file import PENDULUM, read

from irtwin.errors import InputError
from irtwin.simulator.model import read_model
from irtwin.simulator.servos import NAMES, servos
from irtwin.simulator.usd_package import check_package, new_name

Sdf = pytest.importorskip("pxr.Sdf")
ROOT = '#usda 1.0\n(\n    metersPerUnit = 0.01\n    upAxis = "Y"\n    subLayers = [@{}@]\n)\n'


def pack(place: Path, files: dict[str, str | bytes]) -> Path:
    """Write a package of files, that which it opens with first."""
    writer, own = Sdf.ZipFileWriter.CreateNew(str(place)), place.parent / "one"
    for name, text in files.items():
        own.write_bytes(text if isinstance(text, bytes) else text.encode())
        writer.AddFile(str(own), name)
    writer.Save()
    own.unlink()
    return place


def held(place: Path) -> dict[str, bytes]:
    """Return the files of a package, as any reader of archives sees them."""
    with zipfile.ZipFile(place) as archive:
        assert archive.testzip() is None
        assert {one.compress_type for one in archive.infolist()} == {zipfile.ZIP_STORED}
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return pack(
        tmp_path / "arm.usdz",
        {"robot/top.usda": ROOT.format("./parts/arm.usda"), "robot/parts/arm.usda": PENDULUM, "notes.txt": b"\x00\xff"},
    )


def test_a_package_is_read_as_what_is_in_it(package, tmp_path):
    model, alone = read_model(package, ONE), read(tmp_path)
    assert pull(model) == pytest.approx(9.81)
    assert model.numbers("pan") == alone.numbers("pan")
    assert servos(model).numbers == pytest.approx(servos(alone).numbers, rel=1e-12)


def test_an_unchanged_one_is_the_same_bytes_and_a_changed_one_has_its_files_under_a_layer(package, tmp_path):
    own = servos(read_model(package, ONE))
    assert own.written(own.numbers, np.zeros(own.numbers.shape, dtype=bool)) == package.read_bytes()
    changed = {"stiffness": 120.0, "friction": 0.75, "armature": 0.03, "torque_limit": 6.0}
    robots = servo_arm.changed(own, **changed)
    (tmp_path / "away").mkdir()
    better = tmp_path / "away" / "better.usdz"
    better.write_bytes(own.written(robots, robots != own.numbers))
    layer, *before = held(better).items()
    assert dict(before) == held(package)
    assert layer[0] == "changed_1.usda" and b"newton:armature" in layer[1] and b"physics:mass" not in layer[1]
    model = read_model(better, ONE)
    again = dict(zip(NAMES, servos(model).numbers[:, 0], strict=True))
    assert {name: again[name] for name in changed} == pytest.approx(changed, rel=1e-6)
    untouched = [k for k, name in enumerate(NAMES) if name not in changed]
    assert servos(model).numbers[untouched] == pytest.approx(own.numbers[untouched], rel=1e-12)
    assert pull(model) == pytest.approx(9.81)


def test_what_single_precision_holds_is_read_back_to_the_last_digit_again_and_again(package, tmp_path):
    file = read_model(package, ONE).file
    for k, value in enumerate((0.5, 0.0625)):
        tag, name = file.number("pan", "armature")
        place = tmp_path / f"better_{k}.usdz"
        place.write_bytes(file.changed({tag: {name: value}}))
        model = read_model(place, ONE)
        assert model.numbers("pan")["armature"] == pytest.approx(value, rel=1e-12)
        file = model.file
    assert list(held(place)) == ["changed_2.usda", "changed_1.usda", *held(package)]


def test_a_layer_may_stand_over_a_package(package, tmp_path):
    (tmp_path / "over.usda").write_text(ROOT.format("./arm.usdz"))
    assert read_model(tmp_path / "over.usda", ONE).numbers("pan")["damping"] == pytest.approx(0.25)


def test_it_is_written_as_a_package(package, tmp_path):
    file = read_model(package, ONE).file
    file.check_written(tmp_path / "sub" / "better.USDZ")
    with pytest.raises(InputError, match=r"better\.usda: is to be a package, as .*arm\.usdz is; give it the ending"):
        file.check_written(tmp_path / "better.usda")


@pytest.mark.parametrize(
    "named",
    ["/etc/passwd", "../../arm.usda", "../../../arm.usda", "arm.usda", "./none.usda", "a.usdz", "a.usdz[b.usda]"],
)
def test_what_a_layer_names_is_sought_in_the_package_alone(tmp_path, named):
    (tmp_path / "arm.usda").write_text(PENDULUM)
    inside = pack(tmp_path / "a.usdz", {"b.usda": PENDULUM}).read_bytes()
    files = {"one/two/top.usda": ROOT.format("../mid.usda"), "one/mid.usda": ROOT.format(named), "one/a.usdz": inside}
    package = pack(tmp_path / "top.usdz", files)
    with pytest.raises(InputError, match=r"one/mid\.usda names .*, which is no USD file in the package; pack it with"):
        read_model(package, ONE)


def test_layers_that_name_each_other_end(tmp_path):
    files = {"a.usda": ROOT.format("b.usda"), "b.usda": ROOT.format("a.usda")}
    assert check_package(pack(tmp_path / "a.usdz", files)) == ("a.usda", "b.usda")


@pytest.mark.parametrize("name", ["../out.usda", "/out.usda", "a/../../out.usda", "a\\out.usda", "a/./top.usda"])
def test_names_that_lead_out_are_refused(tmp_path, name):
    with zipfile.ZipFile(tmp_path / "arm.usdz", "w") as archive:
        for own in ("a/top.usda", name):
            archive.writestr(zipfile.ZipInfo(own), PENDULUM)
    with pytest.raises(InputError, match=r"arm\.usdz: holds .* twice, or outside itself; pack it anew"):
        read_model(tmp_path / "arm.usdz", ONE)


def test_compressed_files_and_too_many_are_refused(tmp_path, monkeypatch):
    with zipfile.ZipFile(tmp_path / "arm.usdz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("top.usda", PENDULUM)
    with pytest.raises(InputError, match=r"holds top\.usda compressed or encrypted; pack it anew, as `usdzip` does"):
        read_model(tmp_path / "arm.usdz", ONE)
    monkeypatch.setattr("irtwin.simulator.usd_package._MOST", 1)
    with pytest.raises(InputError, match=r"holds 2 files, more than 1; pack those alone that the robot needs"):
        read_model(pack(tmp_path / "two.usdz", {"a.usda": PENDULUM, "b.txt": "b"}), ONE)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"PK nothing" * 100, PENDULUM.encode()])
def test_something_else_is_refused_in_a_line(tmp_path, content, capfd):
    (tmp_path / "arm.usdz").write_bytes(content)
    with pytest.raises(InputError, match=r"arm\.usdz: ") as error:
        read_model(tmp_path / "arm.usdz", ONE)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


def test_a_name_that_is_no_text_is_refused(package):
    package.write_bytes(package.read_bytes().replace(b"top.usda", b"\xff\xfe.usda"))
    with pytest.raises(InputError, match=r"arm\.usdz: is no USD that can be read \(a name in it is no UTF-8\)"):
        read_model(package, ONE)


def test_a_package_that_ends_early_is_refused(package, tmp_path):
    whole = package.read_bytes()
    for stop in range(1, len(whole) - 400, 97):
        cut = tmp_path / f"cut_{stop}.usdz"
        cut.write_bytes(whole[:stop])
        with pytest.raises(InputError):
            read_model(cut, ONE)


def test_a_package_without_a_model_first_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"arm\.usdz: is no package of USD; its first file is to be a USD file"):
        read_model(pack(tmp_path / "arm.usdz", {"notes.txt": "a", "arm.usda": PENDULUM}), ONE)


def test_a_layer_gets_a_name_of_its_own():
    assert new_name(["a.usda"]) == "changed_1.usda"
    assert new_name(["changed_1.usda", "changed_2.usda"]) == "changed_3.usda"
