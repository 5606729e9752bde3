"""Components from NPZ, MAT and universal files, frequency responses from universal files."""

import numpy as np
import pytest
import pyuff
import scipy.io

from twin._checks import InputError
from twin.io.component import read_component_mat, read_component_npz
from twin.io.component_uff import read_component_uff
from twin.io.frf_uff import read_frf_uff

RNG = np.random.default_rng(5)
LINE = np.linspace(-0.3, 0.3, 5)


def arrays(rows=6):
    return {
        "frequency": np.array([0.0, 0.0, 40.0, 95.5]),
        "shapes": RNG.normal(size=(3, rows, 4)),
        "nodes": np.array(["N1", "N2", "N3b"]),
        "positions": RNG.normal(size=(3, 3)),
    }


def full():
    more = {"rail_left_coordinate": LINE, "rail_left_shapes": RNG.normal(size=(5, 6, 4))}
    return arrays() | more | {"loss_factor": 0.004, "modal_mass": np.array([1.0, 4.0, 9.0, 16.0])}


def save_npz(path, content):
    np.savez(path, **content)
    return read_component_npz


def save_mat(path, content):
    content = content | {"nodes": np.array(list(content["nodes"]), dtype=object)} if "nodes" in content else content
    with path.open("wb") as file:
        scipy.io.savemat(file, content)
    return read_component_mat


@pytest.mark.parametrize("save", [save_npz, save_mat])
def test_everything_arrives(tmp_path, save):
    content = full()
    path = tmp_path / "bed.npz"
    component = save(path, content)(path)
    assert component.nodes == ("N1", "N2", "N3b")
    assert np.allclose(component.eigenvalues, (2 * np.pi * content["frequency"]) ** 2)
    scale = np.array([1.0, 2.0, 3.0, 4.0])
    assert np.allclose(component.shapes, content["shapes"] / scale)
    assert np.allclose(component.rails["left"].shapes, content["rail_left_shapes"] / scale)
    assert np.allclose(component.rails["left"].coordinate, LINE)
    assert np.allclose(component.positions, content["positions"])
    assert component.loss_factor == 0.004


def test_names_units_and_fewer_modes(tmp_path):
    content = full()
    content["f_n"] = content.pop("frequency")
    path = tmp_path / "bed.npz"
    np.savez(path, **content)
    component = read_component_npz(path, names={"frequency": "f_n"}, modes=3, length_unit="mm", mass_unit="t")
    scale = np.array([1.0, 2.0, 3.0]) * np.sqrt(1000.0)
    assert np.allclose(component.shapes[:, :3], content["shapes"][:, :3, :3] / scale)
    assert np.allclose(component.shapes[:, 3:], content["shapes"][:, 3:, :3] / scale * 1000.0)
    assert np.allclose(component.positions, content["positions"] / 1000.0)
    assert np.allclose(component.rails["left"].coordinate, LINE / 1000.0)


def test_three_rows_have_no_rotations(tmp_path):
    path = tmp_path / "bed.npz"
    component = save_npz(path, arrays(rows=3))(path)
    assert component.directions == ("x", "y", "z")
    assert np.all(component.shapes[:, 3:] == 0)


@pytest.mark.parametrize("save", [save_npz, save_mat])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequency": None}, "no array 'frequency'.*nodes, positions, shapes"),
        ({"frequency": np.array([1.0, 2.0, 3.0])}, r"shape \(3, 6, 3\).*has \(3, 6, 4\)"),
        ({"nodes": np.array(["N1", "N2"])}, r"shapes must have the shape \(2, 6, 4\)"),
        ({"frequency": np.array([-1.0, 2.0, 3.0, 4.0])}, "frequency must not be negative"),
        ({"shapes": np.zeros((3, 5, 4))}, "6 directions"),
        ({"positions": np.zeros((2, 3))}, r"positions must have the shape \(3, 3\)"),
    ],
)
def test_bad_arrays(tmp_path, save, change, message):
    content = {name: value for name, value in (arrays() | change).items() if value is not None}
    path = tmp_path / "bad"
    with pytest.raises(InputError, match=message):
        save(path.with_suffix(".npz"), content)(path.with_suffix(".npz"))


def test_bad_files(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, **(arrays() | {"nodes": np.array([{"x": 1}], dtype=object)}), allow_pickle=True)
    for reader in (read_component_npz, read_component_mat, read_component_uff, read_frf_uff):
        with pytest.raises(InputError, match="does not exist"):
            reader(tmp_path / "none")
        (tmp_path / "text").write_text("nothing of the kind\n" * 5)
        with pytest.raises(InputError, match=r"cannot be read|holds no"):
            reader(tmp_path / "text")
    with pytest.raises(InputError, match=r"cannot be read.*plain arrays"):
        read_component_npz(path)
    good = tmp_path / "b.npz"
    np.savez(good, **arrays())
    with pytest.raises(InputError, match="modes is 9, but the model has 4"):
        read_component_npz(good, modes=9)
    with pytest.raises(InputError, match=r"length_unit.*'kg'"):
        read_component_npz(good, length_unit="kg")


def nodes_set():
    count = [1, 1]
    return pyuff.prepare_15(
        node_nums=[1, 7], def_cs=count, disp_cs=count, color=count, x=[0.0, 100.0], y=[0.0, 200.0], z=[0.0, 300.0]
    )


def mode_set(number, frequency, mass, shape, **change):
    rows = {f"r{i + 1}": row for i, row in enumerate(shape.T)}
    text = {f"id{i}": "mode" for i in range(1, 6)}
    given = dict(
        model_type=1,
        analysis_type=2,
        data_ch=2 if len(rows) == 3 else 3,
        spec_data_type=8,
        data_type=2,
        n_data_per_node=len(rows),
        load_case=1,
        mode_n=number,
        freq=frequency,
        modal_m=mass,
        modal_damp_vis=0.0,
        modal_damp_his=0.0,
        node_nums=np.array([1, 7]),
    )
    return pyuff.prepare_55(**(given | rows | text | change))


def units_set():
    return pyuff.prepare_164(
        units_code=5, units_description="mm", temp_mode=1, length=1000.0, force=1.0, temp=1.0, temp_offset=0.0
    )


def response_set(node, direction, reference, reference_direction, values, **change):
    text = {f"id{i}": "response" for i in range(1, 6)}
    given = dict(
        binary=0,
        func_type=4,
        ver_num=1,
        load_case_id=0,
        rsp_ent_name="N",
        rsp_node=node,
        rsp_dir=direction,
        ref_ent_name="N",
        ref_node=reference,
        ref_dir=reference_direction,
        abscissa_spacing=1,
        abscissa_min=10.0,
        abscissa_inc=1.0,
        abscissa_spec_data_type=18,
        ordinate_spec_data_type=12,
        orddenom_spec_data_type=13,
        z_axis_spec_data_type=0,
        x=np.arange(10.0, 14.0),
        data=values,
    )
    return pyuff.prepare_58(**(given | text | change))


def write(path, *sets):
    pyuff.UFF(str(path)).write_sets(list(sets), mode="overwrite")
    return path


@pytest.mark.parametrize("rows", [3, 6])
def test_modes_of_a_universal_file(tmp_path, rows):
    shapes = RNG.normal(size=(2, 2, rows))
    path = write(
        tmp_path / "a.uff",
        units_set(),
        nodes_set(),
        mode_set(1, 80.0, 2.5, shapes[0]),
        mode_set(2, 31.0, 1.0, shapes[1]),
    )
    component = read_component_uff(path, names={7: "N7", 1: "N1"})
    assert component.nodes == ("N7", "N1")
    assert np.allclose(np.sqrt(component.eigenvalues) / (2 * np.pi), [31.0, 80.0])
    expected = np.stack([shapes[1], shapes[0] / np.sqrt(2.5)], axis=-1)[::-1] / np.sqrt(1000.0)
    assert np.allclose(component.shapes[:, :3], expected[:, :3], rtol=1e-4)
    assert np.allclose(component.shapes[:, 3:], expected[:, 3:] * 1000.0 if rows == 6 else 0.0, rtol=1e-4)
    assert np.allclose(component.positions[0], [0.1, 0.2, 0.3])
    assert component.directions == ("x", "y", "z", "rx", "ry", "rz")[:rows]
    by_argument = read_component_uff(write(tmp_path / "b.uff", nodes_set(), mode_set(1, 80.0, 2.5, shapes[0])))
    assert by_argument.nodes == ("1", "7")
    assert np.allclose(by_argument.positions[1], [100.0, 200.0, 300.0])


def test_bad_modes_of_a_universal_file(tmp_path):
    shape = RNG.normal(size=(2, 3))
    good = write(tmp_path / "a.uff", nodes_set(), mode_set(1, 80.0, 2.5, shape))
    with pytest.raises(InputError, match="no node 9"):
        read_component_uff(good, names={9: "N9"})
    with pytest.raises(InputError, match="modes is 2, but the model has 1"):
        read_component_uff(good, modes=2)
    with pytest.raises(InputError, match="holds no normal modes"):
        read_component_uff(write(tmp_path / "b.uff", nodes_set()))
    with pytest.raises(InputError, match="holds no nodes"):
        read_component_uff(write(tmp_path / "c.uff", mode_set(1, 80.0, 2.5, shape)))
    with pytest.raises(InputError, match="modal_mass must be positive"):
        read_component_uff(write(tmp_path / "d.uff", nodes_set(), mode_set(1, 80.0, 0.0, shape)))
    mixed = nodes_set() | {"disp_cs": [1, 2]}
    with pytest.raises(InputError, match="different coordinate systems"):
        read_component_uff(write(tmp_path / "f.uff", mixed, mode_set(1, 80.0, 2.5, shape)))
    with pytest.raises(InputError, match="complex"):
        read_component_uff(write(tmp_path / "e.uff", nodes_set(), mode_set(1, 80.0, 1.0, shape + 1j, data_type=5)))


def test_responses_of_a_universal_file(tmp_path):
    values = RNG.normal(size=(2, 4)) + 1j * RNG.normal(size=(2, 4))
    path = write(
        tmp_path / "a.uff", units_set(), response_set(1, 3, 7, -1, values[0]), response_set(7, 5, 7, -1, values[1])
    )
    frf = read_frf_uff(path, names={7: "N7"})
    assert frf.outputs == ("1 z", "N7 ry") and frf.inputs == ("N7 x",) and frf.form == "accelerance"
    assert np.allclose(frf.frequency, [10, 11, 12, 13])
    assert np.allclose(frf["1 z", "N7 x"], -values[0] / 1000.0, rtol=1e-6)
    assert np.allclose(frf["N7 ry", "N7 x"], -values[1], rtol=1e-6)


def test_bad_responses_of_a_universal_file(tmp_path):
    one, z = response_set(1, 3, 7, 1, np.ones(4) + 0j), np.ones(4) + 0j
    path = tmp_path / "a.uff"
    with pytest.raises(InputError, match="'1 z' to '7 x' twice"):
        read_frf_uff(write(path, one, one))
    with pytest.raises(InputError, match="no response of '1 z' to '7 y'"):
        read_frf_uff(write(path, one, response_set(2, 3, 7, 2, z)))
    with pytest.raises(InputError, match=r"mixes accelerance .* and mobility"):
        read_frf_uff(write(path, one, response_set(2, 3, 7, 1, z, ordinate_spec_data_type=11)))
    with pytest.raises(InputError, match="direction 0 at node 1"):
        read_frf_uff(write(path, response_set(1, 0, 7, 1, z)))
    with pytest.raises(InputError, match="data type 12 over 0"):
        read_frf_uff(write(path, response_set(1, 1, 7, 1, z, orddenom_spec_data_type=0)))
    with pytest.raises(InputError, match="other frequencies"):
        read_frf_uff(write(path, one, response_set(2, 3, 7, 1, z, x=np.arange(20.0, 24.0), abscissa_min=20.0)))
    with pytest.raises(InputError, match="holds no frequency response"):
        read_frf_uff(write(path, nodes_set()))
