"""Real bones through every format of surfaces: written by trimesh and VTK, read by pao-sim.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy trimesh vtk
    cargo build --release --example surface_triangles
    /tmp/check/bin/python scripts/check_surfaces.py ../shared/data/vsd/z013 target/release/examples/surface_triangles /tmp/surfaces

The bones are read from PLY by trimesh. Each format's folder is read by pao-sim's own reader, and its triangles are compared
with trimesh's, in LPS, as sets of corners' coordinates with their orientation.
"""

import subprocess
import sys
from pathlib import Path

import numpy
import trimesh
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

BONES = ["Sacrum", "Hip_L", "Hip_R", "Femur_L", "Femur_R"]
LPS = numpy.array([-1, -1, 1], "f4")
HEADER = "3D Slicer output. SPACE=LPS"


def polydata(vertices, faces):
    data, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(numpy_to_vtk(vertices, deep=True))
    sized = numpy.hstack([numpy.full((len(faces), 1), 3), faces]).astype("i8").ravel()
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(sized, deep=True))
    data.SetPoints(points)
    data.SetPolys(cells)
    return data


def vtk_writer(writer, setup):
    def write(vertices, faces, path):
        made = writer()
        setup(made)
        made.SetFileName(str(path))
        made.SetInputData(polydata(vertices, faces))
        assert made.Write() == 1, path

    return write


def trimesh_writer(**how):
    return lambda vertices, faces, path: trimesh.Trimesh(vertices, faces, process=False).export(path, **how)


def legacy(version, kind):
    def setup(writer):
        writer.SetFileVersion(version)
        writer.SetFileType(kind)
        writer.SetHeader(HEADER)

    return vtk_writer(vtk.vtkPolyDataWriter, setup)


def stl(kind):
    def setup(writer):
        writer.SetFileType(kind)
        writer.SetHeader(HEADER)

    return vtk_writer(vtk.vtkSTLWriter, setup)


def ply(kind):
    def setup(writer):
        writer.SetFileType(kind)
        writer.AddComment("SPACE=LPS")

    return vtk_writer(vtk.vtkPLYWriter, setup)


# Name of the folder, ending, frame, writer.
FORMATS = [
    ("trimesh_ply_ascii", "ply", "RAS", trimesh_writer(encoding="ascii")),
    ("trimesh_stl_binary", "stl", "RAS", trimesh_writer()),
    ("trimesh_stl_ascii", "stl", "RAS", trimesh_writer(file_type="stl_ascii")),
    ("trimesh_obj", "obj", "RAS", trimesh_writer()),
    ("vtk_ply_ascii", "ply", "LPS", ply(vtk.VTK_ASCII)),
    ("vtk_ply_binary", "ply", "LPS", ply(vtk.VTK_BINARY)),
    ("vtk_stl_ascii", "stl", "LPS", stl(vtk.VTK_ASCII)),
    ("vtk_stl_binary", "stl", "LPS", stl(vtk.VTK_BINARY)),
    ("vtk42_ascii", "vtk", "LPS", legacy(42, vtk.VTK_ASCII)),
    ("vtk42_binary", "vtk", "LPS", legacy(42, vtk.VTK_BINARY)),
    ("vtk51_ascii", "vtk", "LPS", legacy(51, vtk.VTK_ASCII)),
    ("vtk51_binary", "vtk", "LPS", legacy(51, vtk.VTK_BINARY)),
    ("vtk_obj", "obj", "RAS", vtk_writer(vtk.vtkOBJWriter, lambda writer: None)),
]


def canonical(triangles):
    """Triangles (n, 3, 3) with their least corner first, in order."""
    keys = numpy.ascontiguousarray(triangles).view([("x", "f8"), ("y", "f8"), ("z", "f8")])[..., 0]
    first = numpy.argsort(keys, axis=1, order=("x", "y", "z"))[:, 0]
    turned = numpy.stack([triangles[numpy.arange(len(triangles)), (first + n) % 3] for n in range(3)], 1)
    flat = turned.reshape(-1, 9)
    return flat[numpy.lexsort(flat.T[::-1])]


def main(bones, reader, out):
    out.mkdir(parents=True, exist_ok=True)
    meshes = {b: trimesh.load(bones / f"{b}.ply", process=False) for b in BONES}
    for name, ending, frame, write in FORMATS:
        (out / name).mkdir(exist_ok=True)
        for bone, mesh in meshes.items():
            vertices = numpy.asarray(mesh.vertices, "f4")
            write(vertices * LPS if frame == "LPS" else vertices, mesh.faces, out / name / f"{bone}.{ending}")
    folders = [str(bones)] + [str(out / name) for name, *_ in FORMATS]
    subprocess.run([reader, out, *folders], check=True)
    print("| file | frame | triangles | equal | largest difference mm |\n|---|---|---|---|---|")
    for folder, frame in [(bones.name, "RAS")] + [(name, frame) for name, _, frame, _ in FORMATS]:
        count, equal, most = 0, 0, 0.0
        for bone, mesh in meshes.items():
            expected = (mesh.vertices[mesh.faces] * LPS).astype("f8") + 0.0
            found = numpy.fromfile(out / f"{folder}_{bone}.f64", "<f8").reshape(-1, 3, 3)
            count += len(found)
            equal += len(found) == len(expected) and bool((canonical(found) == canonical(expected)).all())
            # Every reader and writer here keeps the order of triangles.
            most = max(most, abs(found - expected).max() if len(found) == len(expected) else numpy.inf)
        print(f"| {folder} | {frame} | {count} | {equal} of {len(BONES)} bones | {most:.2g} |")


main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
