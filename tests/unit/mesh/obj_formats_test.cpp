// What OBJ files and their material libraries hold that is passed over.
#include "colour_checks.h"

#include <gtest/gtest.h>

#include <string>

namespace relief {
namespace {

using testing::notes_of;
using testing::png_bytes;
using testing::quarters;
using testing::TempFolder;

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", kPlaces = "vt 0 0\nvt 1 0\nvt 0 1\n";
const std::string kTriangle = kCorners + kPlaces + "usemtl skin\nf 1/1 2/2 3/3\n";

TEST(ObjNotes, PlacesWithoutAnImageAreNamed) {
  const TempFolder folder;
  const std::string wanted = "it has places in an image (texture coordinates) and names no image; its surface is plain";
  EXPECT_EQ(notes_of(folder, "a.obj", kTriangle), wanted);
  folder.put("m.mtl", "newmtl skin\nKd 0.8 0.8 0.8\n");
  EXPECT_EQ(notes_of(folder, "a.obj", "mtllib m.mtl\n" + kTriangle), wanted);
  // Where an image or a library is missing, that is said; a colour takes the image's place.
  EXPECT_EQ(notes_of(folder, "a.obj", "mtllib gone.mtl\n" + kTriangle),
            "material library 'gone.mtl' cannot be read; its colours are missing");
  folder.put("m.mtl", "newmtl skin\nKd 1 0 0\n");
  EXPECT_EQ(notes_of(folder, "a.obj", "mtllib m.mtl\n" + kTriangle), "");
}

TEST(ObjNotes, OtherImagesOfMaterialsInUseAreNamed) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  const auto notes = [&](const std::string& lines) {
    folder.put("m.mtl", "newmtl skin\n" + lines + "newmtl unused\nmap_Ks c.png\n");
    return notes_of(folder, "a.obj", "mtllib m.mtl\n" + kTriangle);
  };
  const std::string colour = "Ks 1 1 1\nNs 20\nmap_Kd a.png\n";
  EXPECT_EQ(notes(colour + "map_Bump -bm 0.5 b.png\ndisp b.png\nmap_Ks b.png\nmap_d b.png\n"),
            "images of its materials other than colour were passed over: disp, map_Bump, map_Ks, map_d");
  EXPECT_EQ(notes("map_Ka b.png\nbump b.png\n" + colour),
            "images of its materials other than colour were passed over: bump, map_Ka");
  // The image of the colour once more shows nothing else.
  EXPECT_EQ(notes("map_Ka a.png\nmap_aat on\n" + colour + "map_d -imfchan m a.png\n"), "");
}

TEST(ObjNotes, WhatIsNoPolygonIsNamed) {
  const TempFolder folder;
  const std::string lines = "points or lines were passed over; only faces are read";
  const std::string face = kCorners + "vn 0 0 1\ng all\ns 1\nf 1//1 2//1 3//1\n";
  EXPECT_EQ(notes_of(folder, "a.obj", face), "");
  for (const std::string more : {"l 1 2 3\n", "p 1\n", "f 1 2\n"})
    EXPECT_EQ(notes_of(folder, "a.obj", face + more), lines) << more;
  for (const std::string more : {"curv 0 1 1 2\n", "curv2 1 2\n", "surf 0 1 0 1 1 2 3\n"})
    EXPECT_EQ(notes_of(folder, "a.obj", face + more),
              "curves or curved surfaces were passed over; only polygons are read")
        << more;
}

}  // namespace
}  // namespace relief
