"""The tiny surfaces of tests/data/surfaces, written by trimesh, meshio and VTK.

    python3 -m venv /tmp/fixtures && /tmp/fixtures/bin/pip install trimesh meshio vtk
    /tmp/fixtures/bin/python scripts/make_surface_fixtures.py tests/data/surfaces

All hold the same body: a box of which one corner is pulled out, so that no axis, side or order of corners
can be mistaken without notice. Its numbers stand in src/anatomy/surfaces/mesh_file/tests.rs once more.
Files named *_lps say SPACE=LPS in the words of 3D Slicer and hold the body with x and y negated.
"""

import sys
from pathlib import Path

import meshio
import numpy
import trimesh
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

LOW, HIGH, PULLED = (-10.5, 20.25, 100), (19.5, 60.25, 150), (25.125, 64.5, 160.75)
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
TITLE = "3D Slicer output. SPACE="


def body():
    corners = [[(LOW, HIGH)[n >> axis & 1][axis] for axis in range(3)] for n in range(8)]
    corners[7] = PULLED
    triangles = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
    return numpy.array(corners, "f4"), numpy.array(triangles)


def polydata(points, faces):
    data = vtk.vtkPolyData()
    vtk_points = vtk.vtkPoints()
    vtk_points.SetData(numpy_to_vtk(points, deep=True))
    cells = vtk.vtkCellArray()
    sized = numpy.hstack([[len(f), *f] for f in faces]).astype("i8")
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(sized, deep=True))
    data.SetPoints(vtk_points)
    data.SetPolys(cells)
    return data


def write(writer, path, data):
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    assert writer.Write() == 1, path


def by_vtk(folder, points, triangles):
    lps = points * numpy.array([-1, -1, 1], "f4")
    for kind, code in (("ascii", vtk.VTK_ASCII), ("binary", vtk.VTK_BINARY)):
        writer = vtk.vtkSTLWriter()
        writer.SetFileType(code)
        writer.SetHeader(TITLE + "LPS")
        write(writer, folder / f"vtk_{kind}_lps.stl", polydata(lps, triangles))
        writer = vtk.vtkPLYWriter()
        writer.SetFileType(code)
        writer.AddComment("SPACE=LPS")
        write(writer, folder / f"vtk_{kind}_lps.ply", polydata(lps, triangles))
        for version in (42, 51):
            data = polydata(lps, triangles)
            # What Slicer's polydata have beside their geometry.
            field = vtk.vtkIntArray()
            field.SetName("number")
            field.InsertNextValue(7)
            data.GetFieldData().AddArray(field)
            scalars = vtk.vtkFloatArray()
            scalars.SetName("depth")
            for n in range(len(points)):
                scalars.InsertNextValue(n)
            data.GetPointData().SetScalars(scalars)
            writer = vtk.vtkPolyDataWriter()
            writer.SetFileType(code)
            writer.SetFileVersion(version)
            writer.SetHeader(TITLE + "LPS")
            write(writer, folder / f"vtk{version}_{kind}_lps.vtk", data)
    strips = vtk.vtkStripper()
    strips.SetInputData(polydata(points, triangles))
    strips.Update()
    assert strips.GetOutput().GetNumberOfStrips() > 0
    writer = vtk.vtkPolyDataWriter()
    writer.SetFileType(vtk.VTK_BINARY)
    writer.SetFileVersion(42)
    writer.SetHeader(TITLE + "RAS")
    write(writer, folder / "vtk_strips_ras.vtk", strips.GetOutput())
    writer = vtk.vtkPolyDataWriter()
    writer.SetFileVersion(51)
    write(writer, folder / "vtk_quads.vtk", polydata(points, QUADS))
    writer = vtk.vtkOBJWriter()
    write(writer, folder / "vtk.obj", polydata(points, triangles))

    # As 3D Slicer saves OBJ: by the exporter of a scene.
    mapper, actor, renderer = vtk.vtkPolyDataMapper(), vtk.vtkActor(), vtk.vtkRenderer()
    mapper.SetInputData(polydata(lps, triangles))
    actor.SetMapper(mapper)
    renderer.AddActor(actor)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.AddRenderer(renderer)
    exporter = vtk.vtkOBJExporter()
    exporter.SetRenderWindow(window)
    exporter.SetFilePrefix(str(folder / "vtk_exporter_lps"))
    exporter.SetOBJFileComment(TITLE + "LPS")
    exporter.Write()
    (folder / "vtk_exporter_lps.mtl").unlink()


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    points, triangles = body()
    mesh = trimesh.Trimesh(points, triangles, process=False)
    assert mesh.is_watertight and mesh.volume > 0
    mesh.export(folder / "trimesh_binary.stl")
    mesh.export(folder / "trimesh_ascii.stl", file_type="stl_ascii")
    mesh.export(folder / "trimesh_binary.ply")
    mesh.export(folder / "trimesh_ascii.ply", encoding="ascii")
    mesh.export(folder / "trimesh.obj", header="trimesh")
    other = meshio.Mesh(points, [("triangle", triangles)])
    meshio.write(folder / "meshio_binary.stl", other, binary=True)
    meshio.write(folder / "meshio_ascii.stl", other, binary=False)
    meshio.write(folder / "meshio_binary.ply", other, binary=True)
    meshio.write(folder / "meshio.obj", other)
    text = (folder / "meshio.obj").read_text()
    (folder / "meshio.obj").write_text("# meshio\n" + text.split("\n", 1)[1])
    # An unstructured grid, which is refused.
    meshio.write(folder / "unstructured.vtk", other, file_format="vtk42", binary=False)
    by_vtk(folder, points, triangles)


main(Path(sys.argv[1]))
