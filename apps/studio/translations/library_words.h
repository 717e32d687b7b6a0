// Words of the library that the studio shows in the user's language. Nothing includes this file: lupdate reads it,
// since the library itself knows no translations. A test finds tools, settings and lights that are missing here.

// Titles and help of tools (relief/edit/tools.cpp)
QT_TRANSLATE_NOOP("Tools", "Carve")
QT_TRANSLATE_NOOP("Tools", "Cuts with a ball, strength x pressure x radius deep.")
QT_TRANSLATE_NOOP("Tools", "Deposit")
QT_TRANSLATE_NOOP("Tools", "Lays on material while it is held, whatever the pressure.")
QT_TRANSLATE_NOOP("Tools", "Paint")
QT_TRANSLATE_NOOP("Tools", "Colours the surface.")
QT_TRANSLATE_NOOP("Tools", "Smooth")
QT_TRANSLATE_NOOP("Tools", "Takes out bumps and grain.")
QT_TRANSLATE_NOOP("Tools", "Flatten")
QT_TRANSLATE_NOOP("Tools", "Lowers hills and fills hollows to one plane.")
QT_TRANSLATE_NOOP("Tools", "Inflate")
QT_TRANSLATE_NOOP("Tools", "Swells the surface outwards everywhere under the tool.")
QT_TRANSLATE_NOOP("Tools", "Clay")
QT_TRANSLATE_NOOP("Tools", "Builds up flat layers of clay: fills hollows first.")
QT_TRANSLATE_NOOP("Tools", "Layer")
QT_TRANSLATE_NOOP("Tools", "Raises the surface by one even height, however often the stroke crosses itself.")
QT_TRANSLATE_NOOP("Tools", "Mask")
QT_TRANSLATE_NOOP("Tools", "Protects the surface from all tools.")
QT_TRANSLATE_NOOP("Tools", "Unmask")
QT_TRANSLATE_NOOP("Tools", "Takes the protection away again.")

// Titles and choices of their settings
QT_TRANSLATE_NOOP("Settings", "Radius")
QT_TRANSLATE_NOOP("Settings", "Strength")
QT_TRANSLATE_NOOP("Settings", "Fall-off")
QT_TRANSLATE_NOOP("Settings", "Pressure")
QT_TRANSLATE_NOOP("Settings", "Pressure drives")
QT_TRANSLATE_NOOP("Settings", "strength")
QT_TRANSLATE_NOOP("Settings", "radius")
QT_TRANSLATE_NOOP("Settings", "both")
QT_TRANSLATE_NOOP("Settings", "Sample spacing")
QT_TRANSLATE_NOOP("Settings", "The grid becomes as fine as this part of the radius under a tool. 0 leaves it as it is.")
QT_TRANSLATE_NOOP("Settings", "Stabiliser")
QT_TRANSLATE_NOOP("Settings", "Symmetry")
QT_TRANSLATE_NOOP("Settings", "Resilience")
QT_TRANSLATE_NOOP("Settings", "Exact cut")
QT_TRANSLATE_NOOP("Settings", "Height")
QT_TRANSLATE_NOOP("Settings", "Colour")
QT_TRANSLATE_NOOP("Settings", "own")
QT_TRANSLATE_NOOP("Settings", "linear")
QT_TRANSLATE_NOOP("Settings", "smooth")
QT_TRANSLATE_NOOP("Settings", "dome")
QT_TRANSLATE_NOOP("Settings", "none")
QT_TRANSLATE_NOOP("Settings", "x")
QT_TRANSLATE_NOOP("Settings", "y")
QT_TRANSLATE_NOOP("Settings", "xy")
QT_TRANSLATE_NOOP("Settings", "z")
QT_TRANSLATE_NOOP("Settings", "xz")
QT_TRANSLATE_NOOP("Settings", "yz")
QT_TRANSLATE_NOOP("Settings", "xyz")

// The lights of the sculpting view (relief/render/frame.h, matcaps())
QT_TRANSLATE_NOOP("Matcaps", "clay")
QT_TRANSLATE_NOOP("Matcaps", "red wax")
QT_TRANSLATE_NOOP("Matcaps", "skin")
QT_TRANSLATE_NOOP("Matcaps", "pearl")
QT_TRANSLATE_NOOP("Matcaps", "dark bronze")
QT_TRANSLATE_NOOP("Matcaps", "grey")

// Sample models (relief/mesh/samples.h)
QT_TRANSLATE_NOOP("Samples", "pumpkin")
QT_TRANSLATE_NOOP("Samples", "head")
QT_TRANSLATE_NOOP("Samples", "torus")
QT_TRANSLATE_NOOP("Samples", "bowl")

// Notes of conversions and files, with numbers and names as note_text() takes them out (relief/convert/report.cpp,
// relief/convert/obstacle_text.cpp, relief/mesh/read); the reason behind a colon by itself
QT_TRANSLATE_NOOP(
    "Notes",
    "%1 of %2 triangles has the same corners as another and was left out: the file has these faces more than once")
QT_TRANSLATE_NOOP(
    "Notes",
    "%1 of %2 triangles have the same corners as another and were left out: the file has these faces more than once")
QT_TRANSLATE_NOOP("Notes",
                  "%1 of %2 triangles has no area or coincides: the file's coordinates may be too coarse for the "
                  "shape, as far from the origin")
QT_TRANSLATE_NOOP("Notes",
                  "%1 of %2 triangles have no area or coincide: the file's coordinates may be too coarse for the "
                  "shape, as far from the origin")
QT_TRANSLATE_NOOP("Notes",
                  "%1 vertex had very many triangles around, which rings divide now; the surface stays within the "
                  "rounding of the lattice")
QT_TRANSLATE_NOOP("Notes",
                  "%1 vertices had very many triangles around, which rings divide now; the surface stays within the "
                  "rounding of the lattice")
QT_TRANSLATE_NOOP("Notes",
                  "%1 vertex had faces without a common front-facing direction and long edges: the tips, at most %2 of "
                  "the diagonal long, were cut off and closed with patches")
QT_TRANSLATE_NOOP("Notes",
                  "%1 vertices had faces without a common front-facing direction and long edges: the tips, at most %2 "
                  "of the diagonal long, were cut off and closed with patches")
QT_TRANSLATE_NOOP("Notes",
                  "%1 triangle in %2 part that lies farther off than ten times the rest is across, the farthest %3 "
                  "times, near %4, was left out")
QT_TRANSLATE_NOOP("Notes",
                  "%1 triangles in %2 part that lies farther off than ten times the rest is across, the farthest %3 "
                  "times, near %4, were left out")
QT_TRANSLATE_NOOP("Notes",
                  "%1 triangles in %2 parts that lie farther off than ten times the rest is across, the farthest %3 "
                  "times, near %4, were left out")
QT_TRANSLATE_NOOP("Notes",
                  "inside and outside cannot be told apart for %1 % of the surface, first near %2; close or delete the "
                  "open sheets there")
QT_TRANSLATE_NOOP("Notes",
                  "a part of %1 triangle at %2, only %3 of the diagonal across, was left out, as no slabs stand on it "
                  "with lattice steps of %4 of the diagonal")
QT_TRANSLATE_NOOP("Notes",
                  "a part of %1 triangles at %2, only %3 of the diagonal across, was left out, as no slabs stand on it "
                  "with lattice steps of %4 of the diagonal")
QT_TRANSLATE_NOOP("Notes", "%1 more such part was left out")
QT_TRANSLATE_NOOP("Notes", "%1 more such parts were left out")
QT_TRANSLATE_NOOP("Notes", "the source was rebuilt as a solid with voxels of %1 of the diagonal")
QT_TRANSLATE_NOOP("Notes", "no fewer than %1 slabs were found that hold it")
QT_TRANSLATE_NOOP("Notes", "the shell failed its check")
QT_TRANSLATE_NOOP("Notes",
                  "the usual error of %1 of the diagonal, %2, is not kept in %3 of %4 slab: between samples their "
                  "surface lies up to %5 off")
QT_TRANSLATE_NOOP("Notes",
                  "the usual error of %1 of the diagonal, %2, is not kept in %3 of %4 slabs: between samples their "
                  "surface lies up to %5 off")
QT_TRANSLATE_NOOP("Notes", "a vertex has %1 triangles around it, too many to compare")
QT_TRANSLATE_NOOP("Notes", "%1 vertex has no common front-facing direction")
QT_TRANSLATE_NOOP("Notes", "%1 vertices have no common front-facing direction")
QT_TRANSLATE_NOOP("Notes", "%1 triangle intersects others")
QT_TRANSLATE_NOOP("Notes", "%1 triangles intersect others")
QT_TRANSLATE_NOOP("Notes", "what fills holes intersects itself or the source, in %1 triangle")
QT_TRANSLATE_NOOP("Notes", "what fills holes intersects itself or the source, in %1 triangles")
QT_TRANSLATE_NOOP("Notes", "%1 triangle lies on others, or too near to tell apart")
QT_TRANSLATE_NOOP("Notes", "%1 triangles lie on others, or too near to tell apart")
QT_TRANSLATE_NOOP("Notes", "%1 triangle has another over it that folds")
QT_TRANSLATE_NOOP("Notes", "%1 triangles have another over it that folds")
QT_TRANSLATE_NOOP("Notes", "a vertex has %1 triangles around it, too many to compare, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 vertex has no common front-facing direction, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 vertices have no common front-facing direction, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangle intersects others, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangles intersect others, first near %2")
QT_TRANSLATE_NOOP("Notes", "what fills holes intersects itself or the source, in %1 triangle, first near %2")
QT_TRANSLATE_NOOP("Notes", "what fills holes intersects itself or the source, in %1 triangles, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangle lies on others, or too near to tell apart, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangles lie on others, or too near to tell apart, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangle has another over it that folds, first near %2")
QT_TRANSLATE_NOOP("Notes", "%1 triangles have another over it that folds, first near %2")
QT_TRANSLATE_NOOP(
    "Notes", "tools find little clay: %1 % of the fibres have less than %2 below the surface, the least %3 near %4")
QT_TRANSLATE_NOOP("Notes", "%1 objects that the file marks as support or other were left out")
QT_TRANSLATE_NOOP("Notes",
                  "colours that were painted in a slicer (paint_color) are in a form of its own and were passed over")
QT_TRANSLATE_NOOP("Notes", "image %1 is damaged; its surface is plain")
QT_TRANSLATE_NOOP("Notes", "image %1 is not in the file; its surface is plain")
QT_TRANSLATE_NOOP("Notes", "image %1 is not beside the mesh or cannot be read; its surface is plain")
QT_TRANSLATE_NOOP("Notes", "there are more than %1 images; the surface of the others is plain")
QT_TRANSLATE_NOOP("Notes", "beams of a lattice were passed over; only its triangles are read")
QT_TRANSLATE_NOOP("Notes", "its faces have numbers of a colour map, which is in another file; its surface is plain")
QT_TRANSLATE_NOOP("Notes", "it ends without endsolid, as a file does that was cut off; its %1 facets are whole")
QT_TRANSLATE_NOOP("Notes", "it declares %1 triangles as a binary STL, and its size is that of %2, which were read")
QT_TRANSLATE_NOOP("Notes", "it declares %1 triangles as a binary STL, and holds %2 bytes more, which were passed over")
QT_TRANSLATE_NOOP("Notes", "a texture transform is malformed")
QT_TRANSLATE_NOOP("Notes", "a texture names no image that can be read")
QT_TRANSLATE_NOOP("Notes", "its animations were passed over; it stands in the pose of its nodes")
QT_TRANSLATE_NOOP("Notes", "images of its materials other than colour were passed over")
QT_TRANSLATE_NOOP("Notes", "it has places in an image (texture coordinates) and names no image; its surface is plain")
QT_TRANSLATE_NOOP("Notes", "its images were passed over, as no face or vertex has a place in one (texture coordinates)")
QT_TRANSLATE_NOOP("Notes", "values of its vertices that have no use here were passed over")
QT_TRANSLATE_NOOP("Notes", "values of its faces that have no use here were passed over")
QT_TRANSLATE_NOOP("Notes", "parts of it that have no use here were passed over")
QT_TRANSLATE_NOOP("Notes", "its lines hold more values than its header declares; these were passed over")
QT_TRANSLATE_NOOP("Notes", "it holds %1 byte more than it declares, which was passed over")
QT_TRANSLATE_NOOP("Notes", "it holds %1 bytes more than it declares, which were passed over")
QT_TRANSLATE_NOOP("Notes", "points or lines were passed over; only faces are read")
QT_TRANSLATE_NOOP("Notes", "curves or curved surfaces were passed over; only polygons are read")
QT_TRANSLATE_NOOP("Notes", "values of its facets that are no colours were passed over")
QT_TRANSLATE_NOOP("Notes", "colours between its facets (color) are not part of STL and were passed over")
QT_TRANSLATE_NOOP("Notes", "cameras or lights were passed over")
QT_TRANSLATE_NOOP("Notes", "%1 mesh outside its scene was left out")
QT_TRANSLATE_NOOP("Notes", "%1 meshes outside its scene were left out")
QT_TRANSLATE_NOOP("Notes", "%1 object that is not in its build list was left out")
QT_TRANSLATE_NOOP("Notes", "%1 objects that are not in its build list were left out")
QT_TRANSLATE_NOOP("Notes", "layers over an image could not be mixed with it; only one of them shows")
QT_TRANSLATE_NOOP("Notes", "its faces have colours, too; those of its vertices are used")
QT_TRANSLATE_NOOP("Notes", "its vertices have colours, too; those of its images are used")
QT_TRANSLATE_NOOP("Notes", "%1 corners have no place in the image of their material")
QT_TRANSLATE_NOOP("Notes", "material library %1 does not lie beside the mesh")
QT_TRANSLATE_NOOP("Notes", "material library %1 cannot be read; its colours are missing")
QT_TRANSLATE_NOOP("Notes", "material %1 is in no material library")
