<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de">
<context>
    <name>AxisBall</name>
    <message>
        <source>From the right (+x)</source>
        <translation>Von rechts (+x)</translation>
    </message>
    <message>
        <source>From the top (+y)</source>
        <translation>Von oben (+y)</translation>
    </message>
    <message>
        <source>From the front (+z)</source>
        <translation>Von vorn (+z)</translation>
    </message>
    <message>
        <source>From the left (-x)</source>
        <translation>Von links (-x)</translation>
    </message>
    <message>
        <source>From below (-y)</source>
        <translation>Von unten (-y)</translation>
    </message>
    <message>
        <source>From behind (-z)</source>
        <translation>Von hinten (-z)</translation>
    </message>
</context>
<context>
    <name>Colour</name>
    <message>
        <source>clay</source>
        <translation>Ton</translation>
    </message>
    <message>
        <source>brick red</source>
        <translation>Ziegelrot</translation>
    </message>
    <message>
        <source>ochre</source>
        <translation>Ocker</translation>
    </message>
    <message>
        <source>moss green</source>
        <translation>Moosgrün</translation>
    </message>
    <message>
        <source>sea blue</source>
        <translation>Meerblau</translation>
    </message>
    <message>
        <source>night blue</source>
        <translation>Nachtblau</translation>
    </message>
    <message>
        <source>plaster white</source>
        <translation>Gipsweiß</translation>
    </message>
    <message>
        <source>chestnut brown</source>
        <translation>Kastanienbraun</translation>
    </message>
    <message>
        <source>coral</source>
        <translation>Koralle</translation>
    </message>
    <message>
        <source>sun yellow</source>
        <translation>Sonnengelb</translation>
    </message>
    <message>
        <source>leaf green</source>
        <translation>Blattgrün</translation>
    </message>
    <message>
        <source>sky blue</source>
        <translation>Himmelblau</translation>
    </message>
    <message>
        <source>lavender</source>
        <translation>Lavendel</translation>
    </message>
    <message>
        <source>plum</source>
        <translation>Pflaume</translation>
    </message>
    <message>
        <source>ash grey</source>
        <translation>Aschgrau</translation>
    </message>
    <message>
        <source>soot black</source>
        <translation>Rußschwarz</translation>
    </message>
    <message>
        <source>close to %1, %2</source>
        <translation>nahe bei %1, %2</translation>
    </message>
</context>
<context>
    <name>HandSound</name>
    <message>
        <source>No loudspeaker was found.</source>
        <translation>Es wurde kein Lautsprecher gefunden.</translation>
    </message>
    <message>
        <source>The loudspeaker could not be opened.</source>
        <translation>Der Lautsprecher ließ sich nicht öffnen.</translation>
    </message>
</context>
<context>
    <name>HandText</name>
    <message>
        <source>The device does not answer; it is tried again.</source>
        <translation>Das Gerät antwortet nicht; es wird weiter versucht.</translation>
    </message>
    <message>
        <source>The hand moved too fast; forces are off until you let go.</source>
        <translation>Die Hand war zu schnell; die Kräfte sind aus, bis Sie loslassen.</translation>
    </message>
    <message>
        <source>The surface changed under the hand; forces are off until you lift off.</source>
        <translation>Die Oberfläche hat sich unter der Hand geändert; die Kräfte sind aus, bis Sie abheben.</translation>
    </message>
    <message>
        <source>The computer stood still for a moment; forces are off until you lift off.</source>
        <translation>Der Rechner stand einen Augenblick still; die Kräfte sind aus, bis Sie abheben.</translation>
    </message>
    <message>
        <source>The device answers again.</source>
        <translation>Das Gerät antwortet wieder.</translation>
    </message>
    <message>
        <source>The device answers again; forces come back when you lift off.</source>
        <translation>Das Gerät antwortet wieder; die Kräfte kommen zurück, wenn Sie abheben.</translation>
    </message>
    <message>
        <source>Forces come back when you lift off the surface.</source>
        <translation>Die Kräfte kommen zurück, wenn Sie von der Oberfläche abheben.</translation>
    </message>
    <message>
        <source>The tool is inside the model; forces come when you have pulled it out.</source>
        <translation>Das Werkzeug steckt im Modell; die Kräfte kommen, wenn Sie es herausgezogen haben.</translation>
    </message>
    <message>
        <source>The device gave a position that cannot be right; forces are off until you lift off.</source>
        <translation>Das Gerät meldete eine unmögliche Position; die Kräfte sind aus, bis Sie abheben.</translation>
    </message>
    <message>
        <source>The device&apos;s clock jumped; forces are off until you lift off.</source>
        <translation>Die Uhr des Geräts ist gesprungen; die Kräfte sind aus, bis Sie abheben.</translation>
    </message>
    <message>
        <source>Forces are off until you lift off.</source>
        <translation>Die Kräfte sind aus, bis Sie abheben.</translation>
    </message>
    <message>
        <source>You press harder than the force limit.</source>
        <translation>Sie drücken stärker als die Kraftgrenze.</translation>
    </message>
    <message>
        <source>The motors rest: less force for a while.</source>
        <translation>Die Motoren ruhen: eine Weile weniger Kraft.</translation>
    </message>
    <message>
        <source>Slower, please: the hand is being braked.</source>
        <translation>Bitte langsamer: Die Hand wird gebremst.</translation>
    </message>
    <message>
        <source>The computer is busy; the surface feels softer.</source>
        <translation>Der Rechner ist ausgelastet; die Oberfläche fühlt sich weicher an.</translation>
    </message>
    <message>
        <source>The arm turns but does not move: is it calibrated?</source>
        <translation>Der Arm dreht sich, bewegt sich aber nicht: Ist er kalibriert?</translation>
    </message>
    <message>
        <source>Holding the surface, with less force than it asks for.</source>
        <translation>Hält die Oberfläche, mit weniger Kraft als nötig.</translation>
    </message>
    <message>
        <source>Forces are off. You switched them off.</source>
        <translation>Die Kräfte sind aus. Sie haben sie ausgeschaltet.</translation>
    </message>
    <message>
        <source>Waiting for the device.</source>
        <translation>Wartet auf das Gerät.</translation>
    </message>
    <message>
        <source>In the air. All is well.</source>
        <translation>In der Luft. Alles in Ordnung.</translation>
    </message>
    <message>
        <source>Holding the surface. All is well.</source>
        <translation>Hält die Oberfläche. Alles in Ordnung.</translation>
    </message>
    <message>
        <source>The device has switched its forces off itself.</source>
        <translation>Das Gerät hat seine Kräfte selbst ausgeschaltet.</translation>
    </message>
    <message>
        <source>simulated</source>
        <translation>simuliert</translation>
    </message>
    <message>
        <source>contract-tested against a fake; never run on hardware</source>
        <translation>gegen eine Nachbildung geprüft; nie an einem Gerät gelaufen</translation>
    </message>
    <message>
        <source>field-tested</source>
        <translation>am Gerät erprobt</translation>
    </message>
</context>
<context>
    <name>LayersPanel</name>
    <message>
        <source>Form</source>
        <translation>Form</translation>
    </message>
    <message>
        <source>The shape itself</source>
        <translation>Die Gestalt selbst</translation>
    </message>
    <message>
        <source>Colour</source>
        <translation>Farbe</translation>
    </message>
    <message>
        <source>Show the painted colours</source>
        <translation>Aufgemalte Farben zeigen</translation>
    </message>
    <message>
        <source>Mask</source>
        <translation>Maske</translation>
    </message>
    <message>
        <source>Show what is protected, darker</source>
        <translation>Geschütztes dunkler zeigen</translation>
    </message>
    <message>
        <source>Stiffness</source>
        <translation>Steifigkeit</translation>
    </message>
    <message>
        <source>Felt with a device</source>
        <translation>Mit einem Gerät zu fühlen</translation>
    </message>
    <message>
        <source>Static friction</source>
        <translation>Haftreibung</translation>
    </message>
    <message>
        <source>Dynamic friction</source>
        <translation>Gleitreibung</translation>
    </message>
    <message>
        <source>Strata</source>
        <translation>Gesteinsschichten</translation>
    </message>
</context>
<context>
    <name>Matcaps</name>
    <message>
        <source>clay</source>
        <translation>Ton</translation>
    </message>
    <message>
        <source>red wax</source>
        <translation>rotes Wachs</translation>
    </message>
    <message>
        <source>skin</source>
        <translation>Haut</translation>
    </message>
    <message>
        <source>pearl</source>
        <translation>Perlmutt</translation>
    </message>
    <message>
        <source>dark bronze</source>
        <translation>dunkle Bronze</translation>
    </message>
    <message>
        <source>grey</source>
        <translation>Grau</translation>
    </message>
</context>
<context>
    <name>Notes</name>
    <message>
        <source>tools find little clay: %1 % of the fibres have less than %2 below the surface, the least %3 near %4</source>
        <translation>Werkzeuge finden wenig Ton: %1 % der Fasern haben weniger als %2 unter der Oberfläche, die kürzeste %3 bei %4</translation>
    </message>
    <message>
        <source>%1 of %2 triangles have the same corners as another and were left out: the file has these faces more than once</source>
        <translation>%1 von %2 Dreiecken haben dieselben Ecken wie andere und wurden weggelassen: Die Datei hat diese Flächen mehrfach</translation>
    </message>
    <message>
        <source>%1 of %2 triangles have no area or coincide: the file&apos;s coordinates may be too coarse for the shape, as far from the origin</source>
        <translation>%1 von %2 Dreiecken haben keine Fläche oder fallen zusammen: Die Koordinaten der Datei sind vielleicht zu grob für die Form, etwa weit vom Ursprung</translation>
    </message>
    <message>
        <source>%1 vertex had faces without a common front-facing direction and long edges: the tips, at most %2 of the diagonal long, were cut off and closed with patches</source>
        <translation>%1 Ecke hatte Flächen, die keine Richtung alle von vorn sieht, und lange Kanten: Die Spitze, höchstens %2 der Diagonale lang, wurde abgeschnitten und geschlossen</translation>
    </message>
    <message>
        <source>%1 vertices had faces without a common front-facing direction and long edges: the tips, at most %2 of the diagonal long, were cut off and closed with patches</source>
        <translation>%1 Ecken hatten Flächen, die keine Richtung alle von vorn sieht, und lange Kanten: Die Spitzen, höchstens %2 der Diagonale lang, wurden abgeschnitten und geschlossen</translation>
    </message>
    <message>
        <source>%1 more such parts were left out</source>
        <translation>%1 weitere solche Teile wurden weggelassen</translation>
    </message>
    <message>
        <source>%1 triangles in %2 parts that lie farther off than ten times the rest is across, the farthest %3 times, near %4, were left out</source>
        <translation>%1 Dreiecke in %2 Teilen, weiter entfernt als das Zehnfache der Breite des Restes (bis zum %3-fachen), bei %4, wurden weggelassen</translation>
    </message>
    <message>
        <source>%1 objects that the file marks as support or other were left out</source>
        <translation>%1 Objekte, die in der Datei als Stützen oder anderes markiert sind, wurden weggelassen</translation>
    </message>
    <message>
        <source>colours that were painted in a slicer (paint_color) are in a form of its own and were passed over</source>
        <translation>Farben, die in einem Slicer gemalt wurden (paint_color), haben eine eigene Form und wurden übergangen</translation>
    </message>
    <message>
        <source>image %1 is damaged; its surface is plain</source>
        <translation>Das Bild %1 ist beschädigt; seine Fläche ist einfarbig</translation>
    </message>
    <message>
        <source>image %1 is not in the file; its surface is plain</source>
        <translation>Das Bild %1 ist nicht in der Datei; seine Fläche ist einfarbig</translation>
    </message>
    <message>
        <source>image %1 is not beside the mesh or cannot be read; its surface is plain</source>
        <translation>Das Bild %1 liegt nicht neben dem Netz oder ist nicht lesbar; seine Fläche ist einfarbig</translation>
    </message>
    <message>
        <source>there are more than %1 images; the surface of the others is plain</source>
        <translation>Es sind mehr als %1 Bilder; die Flächen der übrigen sind einfarbig</translation>
    </message>
    <message>
        <source>beams of a lattice were passed over; only its triangles are read</source>
        <translation>Stäbe eines Gitters wurden übergangen; gelesen werden nur seine Dreiecke</translation>
    </message>
    <message>
        <source>its faces have numbers of a colour map, which is in another file; its surface is plain</source>
        <translation>Die Flächen haben Nummern einer Farbtafel, die in einer anderen Datei ist; die Oberfläche ist einfarbig</translation>
    </message>
    <message>
        <source>it ends without endsolid, as a file does that was cut off; its %1 facets are whole</source>
        <translation>Die Datei endet ohne endsolid, als wäre sie abgeschnitten; ihre %1 Facetten sind vollständig</translation>
    </message>
    <message>
        <source>it declares %1 triangles as a binary STL, and its size is that of %2, which were read</source>
        <translation>Die Datei nennt als binäres STL %1 Dreiecke, hat aber die Größe von %2; diese wurden gelesen</translation>
    </message>
    <message>
        <source>it declares %1 triangles as a binary STL, and holds %2 bytes more, which were passed over</source>
        <translation>Die Datei nennt als binäres STL %1 Dreiecke und enthält %2 Bytes mehr; diese wurden übergangen</translation>
    </message>
    <message>
        <source>a texture transform is malformed</source>
        <translation>Die Abbildung einer Textur ist fehlerhaft</translation>
    </message>
    <message>
        <source>a texture names no image that can be read</source>
        <translation>Eine Textur nennt kein lesbares Bild</translation>
    </message>
    <message>
        <source>its animations were passed over; it stands in the pose of its nodes</source>
        <translation>Animationen wurden übergangen; die Form steht in der Haltung ihrer Knoten</translation>
    </message>
    <message>
        <source>images of its materials other than colour were passed over</source>
        <translation>Bilder der Materialien außer der Farbe wurden übergangen</translation>
    </message>
    <message>
        <source>it has places in an image (texture coordinates) and names no image; its surface is plain</source>
        <translation>Die Datei hat Plätze in einem Bild (Texturkoordinaten) und nennt kein Bild; die Oberfläche ist einfarbig</translation>
    </message>
    <message>
        <source>its images were passed over, as no face or vertex has a place in one (texture coordinates)</source>
        <translation>Die Bilder wurden übergangen, da keine Fläche oder Ecke einen Platz in einem hat (Texturkoordinaten)</translation>
    </message>
    <message>
        <source>values of its vertices that have no use here were passed over</source>
        <translation>Werte der Ecken, die hier keinen Nutzen haben, wurden übergangen</translation>
    </message>
    <message>
        <source>values of its faces that have no use here were passed over</source>
        <translation>Werte der Flächen, die hier keinen Nutzen haben, wurden übergangen</translation>
    </message>
    <message>
        <source>parts of it that have no use here were passed over</source>
        <translation>Teile der Datei, die hier keinen Nutzen haben, wurden übergangen</translation>
    </message>
    <message>
        <source>its lines hold more values than its header declares; these were passed over</source>
        <translation>Zeilen enthalten mehr Werte, als der Kopf der Datei nennt; diese wurden übergangen</translation>
    </message>
    <message>
        <source>it holds %1 byte more than it declares, which was passed over</source>
        <translation>Die Datei enthält %1 Byte mehr, als sie nennt; es wurde übergangen</translation>
    </message>
    <message>
        <source>it holds %1 bytes more than it declares, which were passed over</source>
        <translation>Die Datei enthält %1 Bytes mehr, als sie nennt; diese wurden übergangen</translation>
    </message>
    <message>
        <source>points or lines were passed over; only faces are read</source>
        <translation>Punkte oder Linien wurden übergangen; gelesen werden nur Flächen</translation>
    </message>
    <message>
        <source>curves or curved surfaces were passed over; only polygons are read</source>
        <translation>Kurven oder gekrümmte Flächen wurden übergangen; gelesen werden nur Vielecke</translation>
    </message>
    <message>
        <source>values of its facets that are no colours were passed over</source>
        <translation>Werte der Facetten, die keine Farben sind, wurden übergangen</translation>
    </message>
    <message>
        <source>colours between its facets (color) are not part of STL and were passed over</source>
        <translation>Farben zwischen den Facetten (color) gehören nicht zu STL und wurden übergangen</translation>
    </message>
    <message>
        <source>cameras or lights were passed over</source>
        <translation>Kameras oder Lichter wurden übergangen</translation>
    </message>
    <message>
        <source>%1 mesh outside its scene was left out</source>
        <translation>%1 Netz außerhalb der Szene wurde weggelassen</translation>
    </message>
    <message>
        <source>%1 meshes outside its scene were left out</source>
        <translation>%1 Netze außerhalb der Szene wurden weggelassen</translation>
    </message>
    <message>
        <source>%1 object that is not in its build list was left out</source>
        <translation>%1 Objekt, das nicht in der Bauliste steht, wurde weggelassen</translation>
    </message>
    <message>
        <source>%1 objects that are not in its build list were left out</source>
        <translation>%1 Objekte, die nicht in der Bauliste stehen, wurden weggelassen</translation>
    </message>
    <message>
        <source>layers over an image could not be mixed with it; only one of them shows</source>
        <translation>Schichten über einem Bild ließen sich nicht mit ihm mischen; nur eine davon ist zu sehen</translation>
    </message>
    <message>
        <source>its faces have colours, too; those of its vertices are used</source>
        <translation>Auch die Flächen haben Farben; verwendet werden die der Ecken</translation>
    </message>
    <message>
        <source>its vertices have colours, too; those of its images are used</source>
        <translation>Auch die Ecken haben Farben; verwendet werden die der Bilder</translation>
    </message>
    <message>
        <source>%1 corners have no place in the image of their material</source>
        <translation>%1 Ecken haben keinen Platz im Bild ihres Materials</translation>
    </message>
    <message>
        <source>material library %1 does not lie beside the mesh</source>
        <translation>Die Materialdatei %1 liegt nicht neben dem Netz</translation>
    </message>
    <message>
        <source>material library %1 cannot be read; its colours are missing</source>
        <translation>Die Materialdatei %1 ist nicht lesbar; ihre Farben fehlen</translation>
    </message>
    <message>
        <source>material %1 is in no material library</source>
        <translation>Das Material %1 steht in keiner Materialdatei</translation>
    </message>
    <message>
        <source>%1 of %2 triangles has the same corners as another and was left out: the file has these faces more than once</source>
        <translation>%1 von %2 Dreiecken hat dieselben Ecken wie ein anderes und wurde weggelassen: Die Datei hat solche Flächen mehrfach</translation>
    </message>
    <message>
        <source>%1 of %2 triangles has no area or coincides: the file&apos;s coordinates may be too coarse for the shape, as far from the origin</source>
        <translation>%1 von %2 Dreiecken hat keine Fläche oder fällt mit einem anderen zusammen: Die Koordinaten der Datei sind vielleicht zu grob für die Form, etwa weit vom Ursprung</translation>
    </message>
    <message>
        <source>%1 vertex had very many triangles around, which rings divide now; the surface stays within the rounding of the lattice</source>
        <translation>%1 Ecke hatte sehr viele Dreiecke um sich, die nun Ringe teilen; die Oberfläche bleibt, bis auf die Rundung des Gitters</translation>
    </message>
    <message>
        <source>%1 vertices had very many triangles around, which rings divide now; the surface stays within the rounding of the lattice</source>
        <translation>%1 Ecken hatten sehr viele Dreiecke um sich, die nun Ringe teilen; die Oberfläche bleibt, bis auf die Rundung des Gitters</translation>
    </message>
    <message>
        <source>%1 triangle in %2 part that lies farther off than ten times the rest is across, the farthest %3 times, near %4, was left out</source>
        <translation>%1 Dreieck in %2 Teil, weiter entfernt als das Zehnfache der Breite des Restes (%3-fach), bei %4, wurde weggelassen</translation>
    </message>
    <message>
        <source>%1 triangles in %2 part that lies farther off than ten times the rest is across, the farthest %3 times, near %4, were left out</source>
        <translation>%1 Dreiecke in %2 Teil, weiter entfernt als das Zehnfache der Breite des Restes (%3-fach), bei %4, wurden weggelassen</translation>
    </message>
    <message>
        <source>a part of %1 triangle at %2, only %3 of the diagonal across, was left out, as no slabs stand on it with lattice steps of %4 of the diagonal</source>
        <translation>ein Teil aus %1 Dreieck bei %2, nur %3 der Diagonale breit, wurde weggelassen, weil auf ihm bei Gitterschritten von %4 der Diagonale keine Platten stehen</translation>
    </message>
    <message>
        <source>a part of %1 triangles at %2, only %3 of the diagonal across, was left out, as no slabs stand on it with lattice steps of %4 of the diagonal</source>
        <translation>ein Teil aus %1 Dreiecken bei %2, nur %3 der Diagonale breit, wurde weggelassen, weil auf ihm bei Gitterschritten von %4 der Diagonale keine Platten stehen</translation>
    </message>
    <message>
        <source>%1 more such part was left out</source>
        <translation>%1 weiterer solcher Teil wurde weggelassen</translation>
    </message>
    <message>
        <source>the source was rebuilt as a solid with voxels of %1 of the diagonal</source>
        <translation>Der Scan wurde als Körper aus Voxeln von %1 der Diagonale neu gebaut</translation>
    </message>
    <message>
        <source>no fewer than %1 slabs were found that hold it</source>
        <translation>Weniger als %1 Platten, die ihn halten, wurden nicht gefunden</translation>
    </message>
    <message>
        <source>the shell failed its check</source>
        <translation>Die Hülle bestand ihre Prüfung nicht</translation>
    </message>
    <message>
        <source>the usual error of %1 of the diagonal, %2, is not kept in %3 of %4 slab: between samples their surface lies up to %5 off</source>
        <translation>Der übliche Fehler von %1 der Diagonale, %2, wird in %3 von %4 Platte überschritten: Zwischen den Messpunkten liegt ihre Oberfläche bis zu %5 daneben</translation>
    </message>
    <message>
        <source>the usual error of %1 of the diagonal, %2, is not kept in %3 of %4 slabs: between samples their surface lies up to %5 off</source>
        <translation>Der übliche Fehler von %1 der Diagonale, %2, wird in %3 von %4 Platten überschritten: Zwischen den Messpunkten liegt ihre Oberfläche bis zu %5 daneben</translation>
    </message>
    <message>
        <source>a vertex has %1 triangles around it, too many to compare</source>
        <translation>eine Ecke hat %1 Dreiecke um sich, zu viele zum Vergleichen</translation>
    </message>
    <message>
        <source>%1 vertex has no common front-facing direction</source>
        <translation>%1 Ecke hat keine Richtung, die alle ihre Flächen von vorn sieht</translation>
    </message>
    <message>
        <source>%1 vertices have no common front-facing direction</source>
        <translation>%1 Ecken haben keine Richtung, die alle ihre Flächen von vorn sieht</translation>
    </message>
    <message>
        <source>%1 triangle intersects others</source>
        <translation>%1 Dreieck schneidet andere</translation>
    </message>
    <message>
        <source>%1 triangles intersect others</source>
        <translation>%1 Dreiecke schneiden andere</translation>
    </message>
    <message>
        <source>what fills holes intersects itself or the source, in %1 triangle</source>
        <translation>was Löcher füllt, schneidet sich selbst oder den Scan, in %1 Dreieck</translation>
    </message>
    <message>
        <source>what fills holes intersects itself or the source, in %1 triangles</source>
        <translation>was Löcher füllt, schneidet sich selbst oder den Scan, in %1 Dreiecken</translation>
    </message>
    <message>
        <source>%1 triangle lies on others, or too near to tell apart</source>
        <translation>%1 Dreieck liegt auf anderen oder ihnen zu nah, um sie zu unterscheiden</translation>
    </message>
    <message>
        <source>%1 triangles lie on others, or too near to tell apart</source>
        <translation>%1 Dreiecke liegen auf anderen oder ihnen zu nah, um sie zu unterscheiden</translation>
    </message>
    <message>
        <source>%1 triangle has another over it that folds</source>
        <translation>%1 Dreieck hat ein anderes über sich, das sich faltet</translation>
    </message>
    <message>
        <source>%1 triangles have another over it that folds</source>
        <translation>%1 Dreiecke haben ein anderes über sich, das sich faltet</translation>
    </message>
    <message>
        <source>a vertex has %1 triangles around it, too many to compare, first near %2</source>
        <translation>eine Ecke hat %1 Dreiecke um sich, zu viele zum Vergleichen, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 vertex has no common front-facing direction, first near %2</source>
        <translation>%1 Ecke hat keine Richtung, die alle ihre Flächen von vorn sieht, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 vertices have no common front-facing direction, first near %2</source>
        <translation>%1 Ecken haben keine Richtung, die alle ihre Flächen von vorn sieht, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangle intersects others, first near %2</source>
        <translation>%1 Dreieck schneidet andere, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangles intersect others, first near %2</source>
        <translation>%1 Dreiecke schneiden andere, zuerst bei %2</translation>
    </message>
    <message>
        <source>what fills holes intersects itself or the source, in %1 triangle, first near %2</source>
        <translation>was Löcher füllt, schneidet sich selbst oder den Scan, in %1 Dreieck, zuerst bei %2</translation>
    </message>
    <message>
        <source>what fills holes intersects itself or the source, in %1 triangles, first near %2</source>
        <translation>was Löcher füllt, schneidet sich selbst oder den Scan, in %1 Dreiecken, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangle lies on others, or too near to tell apart, first near %2</source>
        <translation>%1 Dreieck liegt auf anderen oder ihnen zu nah, um sie zu unterscheiden, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangles lie on others, or too near to tell apart, first near %2</source>
        <translation>%1 Dreiecke liegen auf anderen oder ihnen zu nah, um sie zu unterscheiden, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangle has another over it that folds, first near %2</source>
        <translation>%1 Dreieck hat ein anderes über sich, das sich faltet, zuerst bei %2</translation>
    </message>
    <message>
        <source>%1 triangles have another over it that folds, first near %2</source>
        <translation>%1 Dreiecke haben ein anderes über sich, das sich faltet, zuerst bei %2</translation>
    </message>
    <message>
        <source>inside and outside cannot be told apart for %1 % of the surface, first near %2; close or delete the open sheets there</source>
        <translation>Bei %1 % der Oberfläche lassen sich innen und außen nicht unterscheiden, zuerst bei %2; schließen oder löschen Sie dort die offenen Flächen</translation>
    </message>
</context>
<context>
    <name>OpenJob</name>
    <message>
        <source>Reading the scan</source>
        <translation>Der Scan wird gelesen</translation>
    </message>
    <message>
        <source>Opening the model</source>
        <translation>Das Modell wird geöffnet</translation>
    </message>
    <message>
        <source>Checking the slabs</source>
        <translation>Die Platten werden geprüft</translation>
    </message>
    <message>
        <source>Mending the scan</source>
        <translation>Der Scan wird ausgebessert</translation>
    </message>
    <message>
        <source>Preparing the surface: a thin shell</source>
        <translation>Oberfläche vorbereiten: dünne Schale</translation>
    </message>
    <message>
        <source>Preparing the surface: slabs</source>
        <translation>Oberfläche vorbereiten: Platten</translation>
    </message>
    <message>
        <source>Preparing the surface: samples</source>
        <translation>Oberfläche vorbereiten: Messpunkte</translation>
    </message>
    <message>
        <source>Measuring the distance to the scan</source>
        <translation>Abstand zum Scan wird gemessen</translation>
    </message>
    <message>
        <source>Taking over the colours</source>
        <translation>Farben werden übernommen</translation>
    </message>
    <message>
        <source>Saving</source>
        <translation>Wird gespeichert</translation>
    </message>
    <message>
        <source>Certified</source>
        <translation>Zertifiziert</translation>
    </message>
    <message>
        <source>Tolerant</source>
        <translation>Tolerant</translation>
    </message>
    <message>
        <source>Within %1 of the scan.</source>
        <translation>Höchstens %1 vom Scan entfernt.</translation>
    </message>
    <message>
        <source>%1 % of the surface lies over itself and shows its outer side only.</source>
        <translation>%1 % der Oberfläche liegen übereinander; dort ist nur die äußere Seite zu sehen.</translation>
    </message>
    <message numerus="yes">
        <source>%n opening(s) stay open</source>
        <translation>
            <numerusform>%n Öffnung bleibt offen</numerusform>
            <numerusform>%n Öffnungen bleiben offen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n small part(s) were left out</source>
        <translation>
            <numerusform>%n kleines Teil wurde weggelassen</numerusform>
            <numerusform>%n kleine Teile wurden weggelassen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n tiny component(s) were left out</source>
        <translation>
            <numerusform>%n Splitter wurde weggelassen</numerusform>
            <numerusform>%n Splitter wurden weggelassen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n triangle(s) were mended</source>
        <translation>
            <numerusform>%n Dreieck wurde ausgebessert</numerusform>
            <numerusform>%n Dreiecke wurden ausgebessert</numerusform>
        </translation>
    </message>
    <message>
        <source>Nothing was removed.</source>
        <translation>Nichts wurde entfernt.</translation>
    </message>
    <message>
        <source>The slabs do not overlap, but some places of the scan are seen from no side or touch each other.</source>
        <translation>Die Platten überschneiden sich nicht, aber manche Stellen des Scans sind von keiner Seite zu sehen oder berühren einander.</translation>
    </message>
    <message>
        <source>%1 % of what can be seen of the scan is missing.</source>
        <translation>%1 % dessen, was vom Scan zu sehen ist, fehlen.</translation>
    </message>
    <message>
        <source>It stands on a solid that was rebuilt with voxels of %1.</source>
        <translation>Es steht auf einem Körper, der mit Voxeln von %1 neu aufgebaut wurde.</translation>
    </message>
    <message>
        <source>It is not certified, because it is not close enough to the whole scan.</source>
        <translation>Es ist nicht zertifiziert, weil es dem ganzen Scan nicht nahe genug kommt.</translation>
    </message>
    <message numerus="yes">
        <source>%n component(s) far off were left out</source>
        <translation>
            <numerusform>%n weit entferntes Teil wurde weggelassen</numerusform>
            <numerusform>%n weit entfernte Teile wurden weggelassen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n triangle(s) inside of other parts were left out</source>
        <translation>
            <numerusform>%n Dreieck im Inneren anderer Teile wurde weggelassen</numerusform>
            <numerusform>%n Dreiecke im Inneren anderer Teile wurden weggelassen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n point(s) moved by at most %1</source>
        <translation>
            <numerusform>%n Punkt um höchstens %1 verschoben</numerusform>
            <numerusform>%n Punkte um höchstens %1 verschoben</numerusform>
        </translation>
    </message>
    <message>
        <source>%1 % of that solid is thinner than a voxel and is missing.</source>
        <translation>%1 % dieses Körpers sind dünner als ein Voxel und fehlen.</translation>
    </message>
</context>
<context>
    <name>Samples</name>
    <message>
        <source>pumpkin</source>
        <translation>Kürbis</translation>
    </message>
    <message>
        <source>head</source>
        <translation>Kopf</translation>
    </message>
    <message>
        <source>torus</source>
        <translation>Torus</translation>
    </message>
    <message>
        <source>bowl</source>
        <translation>Schale</translation>
    </message>
</context>
<context>
    <name>SessionReport</name>
    <message numerus="yes">
        <source>%n stroke(s) are not in the file yet.</source>
        <translation>
            <numerusform>%n Strich ist noch nicht in der Datei.</numerusform>
            <numerusform>%n Striche sind noch nicht in der Datei.</numerusform>
        </translation>
    </message>
    <message>
        <source>Every stroke is in the file.</source>
        <translation>Jeder Strich ist in der Datei.</translation>
    </message>
    <message>
        <source>Every stroke is kept, in a file without a name yet.</source>
        <translation>Jeder Strich ist aufbewahrt, in einer Datei noch ohne Namen.</translation>
    </message>
    <message>
        <source>File</source>
        <translation>Datei</translation>
    </message>
    <message>
        <source>Made of</source>
        <translation>Entstanden aus</translation>
    </message>
    <message>
        <source>Mode</source>
        <translation>Art</translation>
    </message>
    <message>
        <source>Certified</source>
        <translation>Zertifiziert</translation>
    </message>
    <message>
        <source>Tolerant</source>
        <translation>Tolerant</translation>
    </message>
    <message>
        <source>Slabs</source>
        <translation>Platten</translation>
    </message>
    <message>
        <source>Saved</source>
        <translation>Gespeichert</translation>
    </message>
    <message>
        <source>Session</source>
        <translation>Sitzung</translation>
    </message>
    <message>
        <source>%1 to %2</source>
        <translation>%1 bis %2</translation>
    </message>
    <message>
        <source>No strokes were made.</source>
        <translation>Es wurden keine Striche gemacht.</translation>
    </message>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>Strokes</source>
        <translation>Striche</translation>
    </message>
    <message>
        <source>Dabs</source>
        <translation>Tupfer</translation>
    </message>
    <message>
        <source>Samples changed</source>
        <translation>Geänderte Messpunkte</translation>
    </message>
    <message>
        <source>Strokes that met the clay&apos;s end</source>
        <translation>Striche bis ans Ende des Tons</translation>
    </message>
    <message>
        <source>Processor time</source>
        <translation>Rechenzeit</translation>
    </message>
    <message>
        <source>All</source>
        <translation>Alle</translation>
    </message>
    <message>
        <source>A dab, typical</source>
        <translation>Ein Tupfer, üblich</translation>
    </message>
    <message>
        <source>A dab, 99 % are quicker</source>
        <translation>Ein Tupfer, 99 % sind schneller</translation>
    </message>
    <message>
        <source>Steps taken back</source>
        <translation>Zurückgenommene Schritte</translation>
    </message>
    <message>
        <source>Samples stopped at the clay&apos;s end</source>
        <translation>Am Ende des Tons angehaltene Messpunkte</translation>
    </message>
    <message>
        <source>Points beside the model</source>
        <translation>Punkte neben dem Modell</translation>
    </message>
    <message>
        <source>Device</source>
        <translation>Gerät</translation>
    </message>
    <message>
        <source>Ticks looked at</source>
        <translation>Betrachtete Takte</translation>
    </message>
    <message>
        <source>Ticks missing</source>
        <translation>Fehlende Takte</translation>
    </message>
    <message>
        <source>Late, 99.9 % are less</source>
        <translation>Verspätung, 99,9 % sind kürzer</translation>
    </message>
    <message>
        <source>Computing, 99.9 % are less</source>
        <translation>Rechnen, 99,9 % sind kürzer</translation>
    </message>
    <message>
        <source>Greatest force</source>
        <translation>Größte Kraft</translation>
    </message>
    <message>
        <source>Times without force</source>
        <translation>Zeiten ohne Kraft</translation>
    </message>
    <message>
        <source>%1: report of a session</source>
        <translation>%1: Bericht einer Sitzung</translation>
    </message>
    <message>
        <source>The model at the end</source>
        <translation>Das Modell am Ende</translation>
    </message>
    <message>
        <source>Model</source>
        <translation>Modell</translation>
    </message>
    <message>
        <source>Times and limits</source>
        <translation>Zeiten und Grenzen</translation>
    </message>
    <message>
        <source>Device, in its last minute</source>
        <translation>Gerät, in seiner letzten Minute</translation>
    </message>
</context>
<context>
    <name>Settings</name>
    <message>
        <source>Radius</source>
        <translation>Radius</translation>
    </message>
    <message>
        <source>Strength</source>
        <translation>Stärke</translation>
    </message>
    <message>
        <source>Fall-off</source>
        <translation>Abfall zum Rand</translation>
    </message>
    <message>
        <source>Pressure</source>
        <translation>Druck</translation>
    </message>
    <message>
        <source>Stabiliser</source>
        <translation>Strichberuhigung</translation>
    </message>
    <message>
        <source>Symmetry</source>
        <translation>Symmetrie</translation>
    </message>
    <message>
        <source>Resilience</source>
        <translation>Federnde Haut</translation>
    </message>
    <message>
        <source>Exact cut</source>
        <translation>Genauer Schnitt</translation>
    </message>
    <message>
        <source>Height</source>
        <translation>Höhe</translation>
    </message>
    <message>
        <source>Colour</source>
        <translation>Farbe</translation>
    </message>
    <message>
        <source>own</source>
        <translation>eigener</translation>
    </message>
    <message>
        <source>linear</source>
        <translation>linear</translation>
    </message>
    <message>
        <source>smooth</source>
        <translation>weich</translation>
    </message>
    <message>
        <source>dome</source>
        <translation>Kuppel</translation>
    </message>
    <message>
        <source>none</source>
        <translation>keine</translation>
    </message>
    <message>
        <source>x</source>
        <translation>x</translation>
    </message>
    <message>
        <source>y</source>
        <translation>y</translation>
    </message>
    <message>
        <source>xy</source>
        <translation>xy</translation>
    </message>
    <message>
        <source>z</source>
        <translation>z</translation>
    </message>
    <message>
        <source>xz</source>
        <translation>xz</translation>
    </message>
    <message>
        <source>yz</source>
        <translation>yz</translation>
    </message>
    <message>
        <source>xyz</source>
        <translation>xyz</translation>
    </message>
    <message>
        <source>Pressure drives</source>
        <translation>Druck steuert</translation>
    </message>
    <message>
        <source>strength</source>
        <translation>Stärke</translation>
    </message>
    <message>
        <source>radius</source>
        <translation>Radius</translation>
    </message>
    <message>
        <source>both</source>
        <translation>beides</translation>
    </message>
    <message>
        <source>Sample spacing</source>
        <translation>Abstand der Messpunkte</translation>
    </message>
    <message>
        <source>The grid becomes as fine as this part of the radius under a tool. 0 leaves it as it is.</source>
        <translation>So fein wird das Gitter unter einem Werkzeug, als Teil des Radius. 0 lässt es, wie es ist.</translation>
    </message>
</context>
<context>
    <name>StrokeInput</name>
    <message>
        <source>%1 has no opposite.</source>
        <translation>Zu „%1“ gibt es kein Gegenteil.</translation>
    </message>
</context>
<context>
    <name>Text</name>
    <message>
        <source>just now</source>
        <translation>gerade eben</translation>
    </message>
    <message numerus="yes">
        <source>%n minute(s) ago</source>
        <translation>
            <numerusform>vor %n Minute</numerusform>
            <numerusform>vor %n Minuten</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n hour(s) ago</source>
        <translation>
            <numerusform>vor %n Stunde</numerusform>
            <numerusform>vor %n Stunden</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n day(s) ago</source>
        <translation>
            <numerusform>vor %n Tag</numerusform>
            <numerusform>vor %n Tagen</numerusform>
        </translation>
    </message>
    <message>
        <source>What was asked for is not possible.</source>
        <translation>Was verlangt wurde, ist nicht möglich.</translation>
    </message>
    <message>
        <source>The file or device is not there.</source>
        <translation>Die Datei oder das Gerät ist nicht da.</translation>
    </message>
    <message>
        <source>Reading or writing did not work; a full disk or a missing permission does this.</source>
        <translation>Lesen oder Schreiben ging nicht; das kommt von einem vollen Datenträger oder einer fehlenden Erlaubnis.</translation>
    </message>
    <message>
        <source>The file is damaged, or it is not what its name says.</source>
        <translation>Die Datei ist beschädigt, oder sie ist nicht, was ihr Name sagt.</translation>
    </message>
    <message>
        <source>Files of this kind cannot be read.</source>
        <translation>Dateien dieser Art können nicht gelesen werden.</translation>
    </message>
    <message>
        <source>The file was made by a newer Relief; install that one.</source>
        <translation>Die Datei stammt von einem neueren Relief; installieren Sie dieses.</translation>
    </message>
    <message>
        <source>The surface does not hang together so that it has two sides.</source>
        <translation>Die Fläche hängt nicht so zusammen, dass sie zwei Seiten hat.</translation>
    </message>
    <message>
        <source>No slabs can be laid over this surface.</source>
        <translation>Über diese Fläche lassen sich keine Platten legen.</translation>
    </message>
    <message>
        <source>The device cannot be used now.</source>
        <translation>Das Gerät lässt sich gerade nicht benutzen.</translation>
    </message>
    <message>
        <source>The device no longer answers.</source>
        <translation>Das Gerät antwortet nicht mehr.</translation>
    </message>
    <message>
        <source>It was cancelled.</source>
        <translation>Es wurde abgebrochen.</translation>
    </message>
</context>
<context>
    <name>Tools</name>
    <message>
        <source>Touch</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Feels the surface with a device, and leaves no trace.</source>
        <translation>Fühlt die Oberfläche mit einem Gerät und hinterlässt keine Spur.</translation>
    </message>
    <message>
        <source>Carve</source>
        <translation>Abtragen</translation>
    </message>
    <message>
        <source>Cuts with a ball, strength x pressure x radius deep.</source>
        <translation>Schneidet mit einer Kugel, Stärke × Druck × Radius tief.</translation>
    </message>
    <message>
        <source>Deposit</source>
        <translation>Auftragen</translation>
    </message>
    <message>
        <source>Lays on material while it is held, whatever the pressure.</source>
        <translation>Trägt Material auf, solange es gehalten wird, gleich bei welchem Druck.</translation>
    </message>
    <message>
        <source>Paint</source>
        <translation>Bemalen</translation>
    </message>
    <message>
        <source>Colours the surface.</source>
        <translation>Färbt die Oberfläche.</translation>
    </message>
    <message>
        <source>Smooth</source>
        <translation>Glätten</translation>
    </message>
    <message>
        <source>Takes out bumps and grain.</source>
        <translation>Nimmt Beulen und Körnung heraus.</translation>
    </message>
    <message>
        <source>Flatten</source>
        <translation>Ebnen</translation>
    </message>
    <message>
        <source>Lowers hills and fills hollows to one plane.</source>
        <translation>Senkt Höhen und füllt Mulden bis auf eine Ebene.</translation>
    </message>
    <message>
        <source>Inflate</source>
        <translation>Aufblähen</translation>
    </message>
    <message>
        <source>Swells the surface outwards everywhere under the tool.</source>
        <translation>Bläht die Oberfläche unter dem Werkzeug überall nach außen.</translation>
    </message>
    <message>
        <source>Clay</source>
        <translation>Aufbauen</translation>
    </message>
    <message>
        <source>Builds up flat layers of clay: fills hollows first.</source>
        <translation>Baut flache Lagen Ton auf: füllt zuerst die Mulden.</translation>
    </message>
    <message>
        <source>Layer</source>
        <translation>Schicht</translation>
    </message>
    <message>
        <source>Raises the surface by one even height, however often the stroke crosses itself.</source>
        <translation>Hebt die Oberfläche um eine gleichmäßige Höhe, wie oft der Strich sich auch kreuzt.</translation>
    </message>
    <message>
        <source>Mask</source>
        <translation>Maskieren</translation>
    </message>
    <message>
        <source>Protects the surface from all tools.</source>
        <translation>Schützt die Oberfläche vor allen Werkzeugen.</translation>
    </message>
    <message>
        <source>Unmask</source>
        <translation>Maske lösen</translation>
    </message>
    <message>
        <source>Takes the protection away again.</source>
        <translation>Nimmt den Schutz wieder weg.</translation>
    </message>
</context>
<context>
    <name>relief::studio::Banner</name>
    <message>
        <source>I have read it</source>
        <translation>Gelesen</translation>
    </message>
</context>
<context>
    <name>relief::studio::ColourPalette</name>
    <message>
        <source>Other colour …</source>
        <translation>Andere Farbe …</translation>
    </message>
    <message>
        <source>Colours</source>
        <translation>Farben</translation>
    </message>
    <message>
        <source>Other colour</source>
        <translation>Andere Farbe</translation>
    </message>
    <message>
        <source>Any colour, by hue or by number.</source>
        <translation>Jede Farbe, nach Farbton oder Zahl.</translation>
    </message>
    <message>
        <source>%1, used before</source>
        <translation>%1, schon verwendet</translation>
    </message>
</context>
<context>
    <name>relief::studio::CommandPalette</name>
    <message>
        <source>Find a command …</source>
        <translation>Befehl suchen …</translation>
    </message>
    <message>
        <source>Commands</source>
        <translation>Befehle</translation>
    </message>
    <message>
        <source>Words of a command</source>
        <translation>Wörter eines Befehls</translation>
    </message>
    <message>
        <source>Up and Down choose, Enter does it, Esc closes.</source>
        <translation>Auf und Ab wählen, Enter führt aus, Esc schließt.</translation>
    </message>
    <message>
        <source>Type a few letters of what you want to do</source>
        <translation>Ein paar Buchstaben dessen tippen, was geschehen soll</translation>
    </message>
    <message>
        <source>Commands found</source>
        <translation>Gefundene Befehle</translation>
    </message>
    <message>
        <source>No command has these words.</source>
        <translation>Kein Befehl hat diese Wörter.</translation>
    </message>
</context>
<context>
    <name>relief::studio::CurveEditor</name>
    <message>
        <source>Pressure curve</source>
        <translation>Druckkurve</translation>
    </message>
    <message>
        <source>How strongly the tool acts as you press harder.
Drag a circle, or Tab to it and use the arrows; Home makes the line straight.</source>
        <translation>Wie stark das Werkzeug bei festerem Druck wirkt.
Einen Kreis ziehen oder mit Tab wählen und Pfeiltasten nehmen; Pos1 macht die Linie gerade.</translation>
    </message>
    <message>
        <source>start</source>
        <translation>Anfang</translation>
    </message>
    <message>
        <source>bend</source>
        <translation>Krümmung</translation>
    </message>
    <message>
        <source>end</source>
        <translation>Ende</translation>
    </message>
    <message>
        <source>Starts at %1 % pressure, full at %2 %, exponent %3. Chosen: %4.</source>
        <translation>Beginnt bei %1 % Druck, voll bei %2 %, Exponent %3. Gewählt: %4.</translation>
    </message>
    <message>
        <source>output</source>
        <translation>Wirkung</translation>
    </message>
    <message>
        <source>pressure</source>
        <translation>Druck</translation>
    </message>
</context>
<context>
    <name>relief::studio::DevicePanel</name>
    <message>
        <source>Choose a device</source>
        <translation>Gerät wählen</translation>
    </message>
    <message>
        <source>State of the hand</source>
        <translation>Zustand der Hand</translation>
    </message>
    <message>
        <source>At the cursor</source>
        <translation>Am Zeiger</translation>
    </message>
    <message>
        <source>Force</source>
        <translation>Kraft</translation>
    </message>
    <message>
        <source>Depth under the surface</source>
        <translation>Tiefe unter der Oberfläche</translation>
    </message>
    <message>
        <source>Time per tick</source>
        <translation>Zeit je Takt</translation>
    </message>
    <message>
        <source>Freeze</source>
        <translation>Anhalten</translation>
    </message>
    <message>
        <source>Keeps the plots as they are, to look at them</source>
        <translation>Hält die Kurven an, um sie anzusehen</translation>
    </message>
    <message>
        <source>Forces off</source>
        <translation>Kräfte aus</translation>
    </message>
    <message>
        <source>No force at once (Pause, or Esc twice)</source>
        <translation>Sofort keine Kraft (Pause oder zweimal Esc)</translation>
    </message>
    <message>
        <source>Clutch</source>
        <translation>Kupplung</translation>
    </message>
    <message>
        <source>The device moves, and the tool stays where it is</source>
        <translation>Das Gerät bewegt sich, und das Werkzeug bleibt, wo es ist</translation>
    </message>
    <message>
        <source>Re-centre</source>
        <translation>Zentrieren</translation>
    </message>
    <message>
        <source>Puts the tool before the middle of the picture</source>
        <translation>Setzt das Werkzeug vor die Mitte des Bildes</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Aufnehmen</translation>
    </message>
    <message>
        <source>Writes all that the hand does and feels into a file</source>
        <translation>Schreibt alles, was die Hand tut und fühlt, in eine Datei</translation>
    </message>
    <message>
        <source>Play</source>
        <translation>Abspielen</translation>
    </message>
    <message>
        <source>Plays the last recording as a device</source>
        <translation>Spielt die letzte Aufnahme als Gerät</translation>
    </message>
    <message>
        <source>Sound</source>
        <translation>Ton</translation>
    </message>
    <message>
        <source>Lets the contact be heard</source>
        <translation>Macht den Kontakt hörbar</translation>
    </message>
    <message>
        <source>Force limit</source>
        <translation>Kraftgrenze</translation>
    </message>
    <message>
        <source>No more force than this reaches the hand</source>
        <translation>Mehr Kraft als diese erreicht die Hand nicht</translation>
    </message>
    <message>
        <source>Workspace scale</source>
        <translation>Maßstab des Arbeitsraums</translation>
    </message>
    <message>
        <source>How large the model is in the hand</source>
        <translation>Wie groß das Modell in der Hand ist</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>Beenden</translation>
    </message>
    <message>
        <source>The mouse and the pen sculpt.</source>
        <translation>Maus und Stift formen.</translation>
    </message>
    <message>
        <source>%1 of %2</source>
        <translation>%1 von %2</translation>
    </message>
    <message>
        <source>%1, worst %2</source>
        <translation>%1, max. %2</translation>
    </message>
    <message>
        <source>Drag along a plot to see one moment.</source>
        <translation>Ziehen Sie über eine Kurve, um einen Augenblick zu sehen.</translation>
    </message>
    <message>
        <source>%1 s</source>
        <translation>%1 s</translation>
    </message>
    <message>
        <source>%1 deep</source>
        <translation>%1 tief</translation>
    </message>
    <message>
        <source>tick %1 after %2</source>
        <translation>Takt %1 nach %2</translation>
    </message>
    <message>
        <source>at %1, %2, %3</source>
        <translation>bei %1, %2, %3</translation>
    </message>
    <message>
        <source>Period</source>
        <translation>Periode</translation>
    </message>
    <message>
        <source>%1, longest %2</source>
        <translation>%1, längste %2</translation>
    </message>
</context>
<context>
    <name>relief::studio::Docks</name>
    <message>
        <source>Heading of %1</source>
        <translation>Überschrift von %1</translation>
    </message>
</context>
<context>
    <name>relief::studio::DropArea</name>
    <message>
        <source>Choose a file …</source>
        <translation>Datei wählen …</translation>
    </message>
    <message>
        <source>Choose a file</source>
        <translation>Datei wählen</translation>
    </message>
    <message>
        <source>This kind of file cannot be opened. Known are %1.</source>
        <translation>Diese Art Datei lässt sich nicht öffnen. Bekannt sind %1.</translation>
    </message>
</context>
<context>
    <name>relief::studio::ExportDialog</name>
    <message>
        <source>Export %1</source>
        <translation>%1 exportieren</translation>
    </message>
    <message>
        <source>Every sample: about %1 triangles</source>
        <translation>Jeder Messpunkt: etwa %1 Dreiecke</translation>
    </message>
    <message>
        <source>One sample in %1: about %2 triangles</source>
        <translation>Einer von %1 Messpunkten: etwa %2 Dreiecke</translation>
    </message>
    <message>
        <source>Level of detail</source>
        <translation>Feinheit</translation>
    </message>
    <message>
        <source>Which samples along an edge are taken; each level has about a quarter of the triangles</source>
        <translation>Welche Messpunkte entlang einer Kante zählen; jede Stufe hat etwa ein Viertel der Dreiecke</translation>
    </message>
    <message>
        <source>As the model lies</source>
        <translation>Wie das Modell liegt</translation>
    </message>
    <message>
        <source>z: turns a model whose y is up</source>
        <translation>z: dreht ein Modell, dessen y nach oben zeigt</translation>
    </message>
    <message>
        <source>y: turns a model whose z is up</source>
        <translation>y: dreht ein Modell, dessen z nach oben zeigt</translation>
    </message>
    <message>
        <source>Up axis</source>
        <translation>Achse nach oben</translation>
    </message>
    <message>
        <source>For programs whose up axis is another one</source>
        <translation>Für Programme, in denen eine andere Achse nach oben zeigt</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Export</source>
        <translation>Exportieren</translation>
    </message>
</context>
<context>
    <name>relief::studio::FailureDialog</name>
    <message>
        <source>Copy the details</source>
        <translation>Einzelheiten kopieren</translation>
    </message>
    <message>
        <source>Copies the sentence and the file&apos;s name, for a report</source>
        <translation>Kopiert den Satz und den Namen der Datei, für eine Meldung</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
</context>
<context>
    <name>relief::studio::FileDesk</name>
    <message>
        <source>%1 could not be opened</source>
        <translation>%1 konnte nicht geöffnet werden</translation>
    </message>
    <message>
        <source>Relief models (*.relief)</source>
        <translation>Relief-Modelle (*.relief)</translation>
    </message>
    <message>
        <source>All files (*)</source>
        <translation>Alle Dateien (*)</translation>
    </message>
    <message>
        <source>%1 could not be closed</source>
        <translation>%1 konnte nicht geschlossen werden</translation>
    </message>
    <message>
        <source>%1 is still being opened; cancel that first.</source>
        <translation>%1 wird noch geöffnet; das zuerst abbrechen.</translation>
    </message>
    <message>
        <source>Models and scans</source>
        <translation>Modelle und Scans</translation>
    </message>
</context>
<context>
    <name>relief::studio::ForceMeter</name>
    <message>
        <source>Force</source>
        <translation>Kraft</translation>
    </message>
    <message>
        <source>%1 N</source>
        <translation>%1 N</translation>
    </message>
    <message>
        <source>off</source>
        <translation>aus</translation>
    </message>
    <message>
        <source>%1 of at most %2 N</source>
        <translation>%1 von höchstens %2 N</translation>
    </message>
    <message>
        <source>Forces are off.</source>
        <translation>Die Kräfte sind aus.</translation>
    </message>
</context>
<context>
    <name>relief::studio::Hand</name>
    <message>
        <source>the mouse and the pen sculpt all the same</source>
        <translation>Maus und Stift formen trotzdem</translation>
    </message>
    <message>
        <source>shows and sounds the force; nobody feels it</source>
        <translation>zeigt die Kraft und macht sie hörbar; niemand fühlt sie</translation>
    </message>
    <message>
        <source>No device</source>
        <translation>Kein Gerät</translation>
    </message>
    <message>
        <source>Mouse as a force probe</source>
        <translation>Maus als Kraftsonde</translation>
    </message>
    <message>
        <source>Simulated hand</source>
        <translation>Simulierte Hand</translation>
    </message>
    <message>
        <source>Recording %1</source>
        <translation>Aufnahme %1</translation>
    </message>
    <message>
        <source>The recording has been played.</source>
        <translation>Die Aufnahme ist zu Ende.</translation>
    </message>
    <message>
        <source>The device is lost. Choose it again once it answers.</source>
        <translation>Das Gerät ist verloren. Wählen Sie es wieder, sobald es antwortet.</translation>
    </message>
    <message>
        <source>Recorded into %1.</source>
        <translation>Aufgenommen in %1.</translation>
    </message>
    <message>
        <source>Simulated hand, %1</source>
        <translation>Simulierte Hand, %1</translation>
    </message>
</context>
<context>
    <name>relief::studio::HistoryPanel</name>
    <message>
        <source>History</source>
        <translation>Verlauf</translation>
    </message>
    <message>
        <source>The strokes, oldest first. Choose one to go there.</source>
        <translation>Die Striche, der älteste zuerst. Einen wählen, um dorthin zu gehen.</translation>
    </message>
    <message>
        <source>As converted</source>
        <translation>Wie umgewandelt</translation>
    </message>
    <message numerus="yes">
        <source>%n earlier stroke(s)</source>
        <translation>
            <numerusform>%n früherer Strich</numerusform>
            <numerusform>%n frühere Striche</numerusform>
        </translation>
    </message>
    <message>
        <source>%1, stroke %2</source>
        <translation>%1, Strich %2</translation>
    </message>
    <message>
        <source>%1, step %2</source>
        <translation>%1, Schritt %2</translation>
    </message>
    <message>
        <source>%1. In the file up to here</source>
        <translation>%1. Bis hierher in der Datei</translation>
    </message>
</context>
<context>
    <name>relief::studio::KeyMap</name>
    <message>
        <source>Your keys could not be read; the usual ones hold. The file is now %1.</source>
        <translation>Die Tastenbelegung war nicht lesbar; es gilt die übliche. Die Datei heißt jetzt %1.</translation>
    </message>
</context>
<context>
    <name>relief::studio::KeysPage</name>
    <message>
        <source>Keys of all commands</source>
        <translation>Tasten aller Befehle</translation>
    </message>
    <message>
        <source>Command</source>
        <translation>Befehl</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Change …</source>
        <translation>Ändern …</translation>
    </message>
    <message>
        <source>No key</source>
        <translation>Keine Taste</translation>
    </message>
    <message>
        <source>Usual key</source>
        <translation>Übliche Taste</translation>
    </message>
    <message>
        <source>Take it over</source>
        <translation>Übernehmen</translation>
    </message>
    <message>
        <source>Leave it</source>
        <translation>So lassen</translation>
    </message>
    <message>
        <source>also: %1</source>
        <translation>auch: %1</translation>
    </message>
    <message>
        <source>Press the new key for “%1”, or Esc to leave it.</source>
        <translation>Neue Taste für „%1“ drücken, oder Esc, um nichts zu ändern.</translation>
    </message>
    <message>
        <source>Double click or “Change …”, then press a key. Changed keys are bold.</source>
        <translation>Doppelklick oder „Ändern …“, dann eine Taste drücken. Geänderte Tasten sind fett.</translation>
    </message>
    <message>
        <source>%1 belongs to “%2”.</source>
        <translation>%1 gehört zu „%2“.</translation>
    </message>
</context>
<context>
    <name>relief::studio::Kiosk</name>
    <message>
        <source>Relief</source>
        <translation>Relief</translation>
    </message>
    <message>
        <source>Code to leave</source>
        <translation>Code zum Verlassen</translation>
    </message>
    <message>
        <source>Touch to begin</source>
        <translation>Zum Beginnen berühren</translation>
    </message>
    <message>
        <source>One moment …</source>
        <translation>Einen Augenblick …</translation>
    </message>
    <message>
        <source>One moment … %1 %</source>
        <translation>Einen Augenblick … %1 %</translation>
    </message>
    <message>
        <source>Start again in %1
touch to go on</source>
        <translation>Neubeginn in %1
berühren, um weiterzumachen</translation>
    </message>
</context>
<context>
    <name>relief::studio::KioskChoose</name>
    <message>
        <source>Touch one to begin</source>
        <translation>Zum Beginnen eines berühren</translation>
    </message>
    <message>
        <source>Nothing can be shown just now. Please tell the staff.</source>
        <translation>Gerade kann nichts gezeigt werden. Bitte dem Personal Bescheid geben.</translation>
    </message>
</context>
<context>
    <name>relief::studio::KioskStage</name>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Start again</source>
        <translation>Neu beginnen</translation>
    </message>
    <message>
        <source>Choose another</source>
        <translation>Anderes wählen</translation>
    </message>
</context>
<context>
    <name>relief::studio::LayersPanel</name>
    <message>
        <source>Layers</source>
        <translation>Ebenen</translation>
    </message>
    <message>
        <source>Show %1</source>
        <translation>%1 zeigen</translation>
    </message>
</context>
<context>
    <name>relief::studio::MainWindow</name>
    <message>
        <source>&amp;Open …</source>
        <translation>Ö&amp;ffnen …</translation>
    </message>
    <message>
        <source>&amp;Save</source>
        <translation>&amp;Speichern</translation>
    </message>
    <message>
        <source>Saved as you work: every finished stroke is in %1.</source>
        <translation>Gespeichert wird laufend: Jeder fertige Strich ist in %1.</translation>
    </message>
    <message>
        <source>Save &amp;as …</source>
        <translation>Speichern &amp;unter …</translation>
    </message>
    <message>
        <source>&amp;Export …</source>
        <translation>&amp;Exportieren …</translation>
    </message>
    <message>
        <source>Save a &amp;picture</source>
        <translation>&amp;Bild speichern</translation>
    </message>
    <message>
        <source>&amp;Close the model</source>
        <translation>Modell s&amp;chließen</translation>
    </message>
    <message>
        <source>The model could not be closed</source>
        <translation>Das Modell konnte nicht geschlossen werden</translation>
    </message>
    <message>
        <source>&amp;Quit</source>
        <translation>&amp;Beenden</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Set the radius with the mouse</source>
        <translation>Radius mit der Maus einstellen</translation>
    </message>
    <message>
        <source>Set the strength with the mouse</source>
        <translation>Stärke mit der Maus einstellen</translation>
    </message>
    <message>
        <source>Smaller radius</source>
        <translation>Kleinerer Radius</translation>
    </message>
    <message>
        <source>Larger radius</source>
        <translation>Größerer Radius</translation>
    </message>
    <message>
        <source>Symmetry</source>
        <translation>Symmetrie</translation>
    </message>
    <message>
        <source>Pick a colour from the model</source>
        <translation>Farbe vom Modell aufnehmen</translation>
    </message>
    <message>
        <source>Show all</source>
        <translation>Alles zeigen</translation>
    </message>
    <message>
        <source>View from the front</source>
        <translation>Ansicht von vorn</translation>
    </message>
    <message>
        <source>View from the right</source>
        <translation>Ansicht von rechts</translation>
    </message>
    <message>
        <source>View from above</source>
        <translation>Ansicht von oben</translation>
    </message>
    <message>
        <source>View from behind</source>
        <translation>Ansicht von hinten</translation>
    </message>
    <message>
        <source>View from the left</source>
        <translation>Ansicht von links</translation>
    </message>
    <message>
        <source>View from below</source>
        <translation>Ansicht von unten</translation>
    </message>
    <message>
        <source>Roll left</source>
        <translation>Nach links kippen</translation>
    </message>
    <message>
        <source>Roll right</source>
        <translation>Nach rechts kippen</translation>
    </message>
    <message>
        <source>Perspective or parallel</source>
        <translation>Perspektivisch oder parallel</translation>
    </message>
    <message>
        <source>Slab wires</source>
        <translation>Plattengitter</translation>
    </message>
    <message>
        <source>Heat map</source>
        <translation>Höhenfarben</translation>
    </message>
    <message>
        <source>Cavity</source>
        <translation>Vertiefungen</translation>
    </message>
    <message>
        <source>Draw again</source>
        <translation>Neu zeichnen</translation>
    </message>
    <message>
        <source>Hide or show all panels</source>
        <translation>Alle Bedienfelder aus- oder einblenden</translation>
    </message>
    <message>
        <source>Full screen</source>
        <translation>Vollbild</translation>
    </message>
    <message>
        <source>Light or dark</source>
        <translation>Hell oder dunkel</translation>
    </message>
    <message>
        <source>&amp;File</source>
        <translation>&amp;Datei</translation>
    </message>
    <message>
        <source>Open &amp;recent</source>
        <translation>&amp;Zuletzt geöffnet</translation>
    </message>
    <message>
        <source>Nothing yet</source>
        <translation>Noch nichts</translation>
    </message>
    <message>
        <source>&amp;Edit</source>
        <translation>&amp;Bearbeiten</translation>
    </message>
    <message>
        <source>&amp;Tools</source>
        <translation>&amp;Werkzeuge</translation>
    </message>
    <message>
        <source>&amp;View</source>
        <translation>&amp;Ansicht</translation>
    </message>
    <message>
        <source>&amp;Clay</source>
        <translation>&amp;Ton</translation>
    </message>
    <message>
        <source>Open a scan or a model</source>
        <translation>Scan oder Modell öffnen</translation>
    </message>
    <message>
        <source>Name the model</source>
        <translation>Modell benennen</translation>
    </message>
    <message>
        <source>Relief models (*.relief)</source>
        <translation>Relief-Modelle (*.relief)</translation>
    </message>
    <message>
        <source>Exporting …</source>
        <translation>Wird exportiert …</translation>
    </message>
    <message>
        <source>Saving what is whole …</source>
        <translation>Was heil ist, wird gesichert …</translation>
    </message>
    <message>
        <source>Saving …</source>
        <translation>Wird gespeichert …</translation>
    </message>
    <message>
        <source>Exported to %1</source>
        <translation>Exportiert nach %1</translation>
    </message>
    <message>
        <source>The picture could not be saved</source>
        <translation>Das Bild konnte nicht gespeichert werden</translation>
    </message>
    <message>
        <source>Picture saved: %1</source>
        <translation>Bild gespeichert: %1</translation>
    </message>
    <message>
        <source>Top bar</source>
        <translation>Obere Leiste</translation>
    </message>
    <message>
        <source>Radius</source>
        <translation>Radius</translation>
    </message>
    <message>
        <source>How large the tool is</source>
        <translation>Wie groß das Werkzeug ist</translation>
    </message>
    <message>
        <source>Strength</source>
        <translation>Stärke</translation>
    </message>
    <message>
        <source>How much the tool does</source>
        <translation>Wie viel das Werkzeug bewirkt</translation>
    </message>
    <message>
        <source>Tools</source>
        <translation>Werkzeuge</translation>
    </message>
    <message>
        <source>Status</source>
        <translation>Status</translation>
    </message>
    <message>
        <source>Tool panel</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>Layers panel</source>
        <translation>Ebenen und Material</translation>
    </message>
    <message>
        <source>History panel</source>
        <translation>Strichverlauf</translation>
    </message>
    <message>
        <source>Saved as %1</source>
        <translation>Gespeichert als %1</translation>
    </message>
    <message>
        <source>Saved as %1, with the last steps of the history</source>
        <translation>Gespeichert als %1, mit den letzten Schritten des Verlaufs</translation>
    </message>
    <message>
        <source>The clay ends here: no further in this direction.</source>
        <translation>Hier ist der Ton zu Ende: in dieser Richtung geht es nicht weiter.</translation>
    </message>
    <message>
        <source>The other hand is at work; the stroke was not begun.</source>
        <translation>Die andere Hand arbeitet gerade; der Strich wurde nicht begonnen.</translation>
    </message>
    <message numerus="yes">
        <source>%n old step(s) can no more be undone.</source>
        <translation>
            <numerusform>%n alter Schritt lässt sich nicht mehr zurücknehmen.</numerusform>
            <numerusform>%n alte Schritte lassen sich nicht mehr zurücknehmen.</numerusform>
        </translation>
    </message>
    <message>
        <source>Cancelled; nothing was kept.</source>
        <translation>Abgebrochen; nichts wurde behalten.</translation>
    </message>
    <message>
        <source>Cancelled: nothing was written. The model goes on in %1.</source>
        <translation>Abgebrochen: Geschrieben wurde nichts. Das Modell bleibt in %1.</translation>
    </message>
    <message>
        <source>Software drawing</source>
        <translation>Zeichnen ohne Grafikkarte</translation>
    </message>
    <message>
        <source>Certified</source>
        <translation>Zertifiziert</translation>
    </message>
    <message>
        <source>Tolerant</source>
        <translation>Tolerant</translation>
    </message>
    <message numerus="yes">
        <source>%n slab(s)</source>
        <translation>
            <numerusform>%n Platte</numerusform>
            <numerusform>%n Platten</numerusform>
        </translation>
    </message>
    <message>
        <source>Not everything is saved</source>
        <translation>Nicht alles ist gespeichert</translation>
    </message>
    <message>
        <source>&amp;Preferences …</source>
        <translation>&amp;Einstellungen …</translation>
    </message>
    <message>
        <source>not known before the first picture</source>
        <translation>vor dem ersten Bild nicht bekannt</translation>
    </message>
    <message>
        <source>Device panel</source>
        <translation>Gerätetafel</translation>
    </message>
    <message>
        <source>Device</source>
        <translation>Gerät</translation>
    </message>
    <message>
        <source>&amp;Devices</source>
        <translation>&amp;Geräte</translation>
    </message>
    <message>
        <source>&amp;Play a recording …</source>
        <translation>Aufnahme a&amp;bspielen …</translation>
    </message>
    <message>
        <source>Play a recording</source>
        <translation>Aufnahme abspielen</translation>
    </message>
    <message>
        <source>Recordings (*.rlog)</source>
        <translation>Aufnahmen (*.rlog)</translation>
    </message>
    <message>
        <source>&amp;Forces off</source>
        <translation>&amp;Kräfte aus</translation>
    </message>
    <message>
        <source>Forces &amp;on again</source>
        <translation>Kräfte &amp;wieder ein</translation>
    </message>
    <message>
        <source>&amp;Re-centre</source>
        <translation>&amp;Zentrieren</translation>
    </message>
    <message>
        <source>&amp;Clutch</source>
        <translation>K&amp;upplung</translation>
    </message>
    <message>
        <source>Re&amp;cord</source>
        <translation>&amp;Aufnehmen</translation>
    </message>
    <message>
        <source>&amp;Sound of the contact</source>
        <translation>&amp;Ton des Kontakts</translation>
    </message>
    <message>
        <source>Forces on again</source>
        <translation>Kräfte wieder ein</translation>
    </message>
    <message>
        <source>no device</source>
        <translation>kein Gerät</translation>
    </message>
    <message>
        <source>The z axis is up</source>
        <translation>Die z-Achse zeigt nach oben</translation>
    </message>
    <message>
        <source>&amp;Panels</source>
        <translation>&amp;Bedienfelder</translation>
    </message>
    <message>
        <source>Hel&amp;p</source>
        <translation>Hil&amp;fe</translation>
    </message>
    <message>
        <source>Save what is whole of %1</source>
        <translation>Retten, was von %1 heil ist</translation>
    </message>
    <message>
        <source>-salvaged</source>
        <translation>-gerettet</translation>
    </message>
    <message>
        <source>Nothing could be saved of %1</source>
        <translation>Von %1 konnte nichts gerettet werden</translation>
    </message>
    <message>
        <source>Nothing was lost.</source>
        <translation>Nichts ging verloren.</translation>
    </message>
    <message>
        <source>Lost: %1.</source>
        <translation>Verloren: %1.</translation>
    </message>
    <message>
        <source>Layers and colours</source>
        <translation>Ebenen und Farben</translation>
    </message>
    <message>
        <source>History</source>
        <translation>Verlauf</translation>
    </message>
    <message numerus="yes">
        <source>%n stroke(s) could not be saved yet: %1. You can go on; it is tried again every ten seconds.</source>
        <translation>
            <numerusform>%n Strich konnte noch nicht gespeichert werden: %1. Es kann weitergehen; alle zehn Sekunden wird es erneut versucht.</numerusform>
            <numerusform>%n Striche konnten noch nicht gespeichert werden: %1. Es kann weitergehen; alle zehn Sekunden wird es erneut versucht.</numerusform>
        </translation>
    </message>
    <message>
        <source>Save elsewhere …</source>
        <translation>Anderswo speichern …</translation>
    </message>
    <message>
        <source>Opening</source>
        <translation>Wird geöffnet</translation>
    </message>
    <message>
        <source>Pen: %1, pressure %2, tilt %3°</source>
        <translation>Stift: %1, Druck %2, Neigung %3°</translation>
    </message>
    <message>
        <source>Stand it up</source>
        <translation>Aufstellen</translation>
    </message>
    <message>
        <source>For scans whose z axis points up</source>
        <translation>Für Scans, deren z-Achse nach oben zeigt</translation>
    </message>
    <message>
        <source>Begin</source>
        <translation>Anfangen</translation>
    </message>
    <message>
        <source>Save what is whole …</source>
        <translation>Heiles retten …</translation>
    </message>
    <message>
        <source>Open another file …</source>
        <translation>Andere Datei öffnen …</translation>
    </message>
    <message>
        <source>&amp;Analysis</source>
        <translation>&amp;Analyse</translation>
    </message>
    <message>
        <source>Save a &amp;turntable …</source>
        <translation>&amp;Drehteller-Film speichern …</translation>
    </message>
    <message>
        <source>Save a &amp;report of the session …</source>
        <translation>Bericht der Si&amp;tzung speichern …</translation>
    </message>
    <message>
        <source>No analysis</source>
        <translation>Keine Analyse</translation>
    </message>
    <message>
        <source>Closes the second view</source>
        <translation>Schließt die zweite Ansicht</translation>
    </message>
    <message>
        <source>Displacement</source>
        <translation>Versatz</translation>
    </message>
    <message>
        <source>Where along its fibre the surface lies</source>
        <translation>Wo auf ihrer Faser die Oberfläche liegt</translation>
    </message>
    <message>
        <source>Depth of clay</source>
        <translation>Tiefe des Tons</translation>
    </message>
    <message>
        <source>How much there is to carve or to lay on</source>
        <translation>Wie viel sich abtragen oder auftragen lässt</translation>
    </message>
    <message>
        <source>Slabs</source>
        <translation>Platten</translation>
    </message>
    <message>
        <source>Each slab in a colour of its own</source>
        <translation>Jede Platte in eigener Farbe</translation>
    </message>
    <message>
        <source>Stretch</source>
        <translation>Streckung</translation>
    </message>
    <message>
        <source>Where samples lie far apart</source>
        <translation>Wo Messpunkte weit auseinanderliegen</translation>
    </message>
    <message numerus="yes">
        <source>%n picture(s) saved in %1</source>
        <translation>
            <numerusform>%n Bild gespeichert in %1</numerusform>
            <numerusform>%n Bilder gespeichert in %1</numerusform>
        </translation>
    </message>
    <message>
        <source>The turntable could not be saved</source>
        <translation>Der Drehteller-Film konnte nicht gespeichert werden</translation>
    </message>
    <message>
        <source>Save a report of the session</source>
        <translation>Bericht der Sitzung speichern</translation>
    </message>
    <message>
        <source>Web pages (*.html)</source>
        <translation>Webseiten (*.html)</translation>
    </message>
    <message>
        <source>The report could not be saved</source>
        <translation>Der Bericht konnte nicht gespeichert werden</translation>
    </message>
    <message>
        <source>Report saved: %1</source>
        <translation>Bericht gespeichert: %1</translation>
    </message>
    <message>
        <source>Studio light when still</source>
        <translation>Studiolicht in Ruhe</translation>
    </message>
    <message>
        <source>Mend it and try again</source>
        <translation>Ausbessern und erneut versuchen</translation>
    </message>
    <message>
        <source>Makes the scan a solid first; what is thinner than its voxels is lost</source>
        <translation>Macht aus dem Scan zuerst einen Körper; was dünner ist als dessen Voxel, geht verloren</translation>
    </message>
    <message>
        <source>Force meter</source>
        <translation>Kraftmesser</translation>
    </message>
    <message>
        <source>Make &amp;room where the clay has run out</source>
        <translation>&amp;Raum schaffen, wo der Ton zu Ende ist</translation>
    </message>
    <message>
        <source>Make everything &amp;finer</source>
        <translation>Alles &amp;feiner machen</translation>
    </message>
    <message>
        <source>Make &amp;new slabs for the model</source>
        <translation>&amp;Neue Platten für das Modell machen</translation>
    </message>
    <message>
        <source>Stop making slabs</source>
        <translation>Arbeit an den Platten abbrechen</translation>
    </message>
    <message>
        <source>%1 … You can go on sculpting.</source>
        <translation>%1 … Sie können weiterarbeiten.</translation>
    </message>
    <message>
        <source>There is room again.</source>
        <translation>Jetzt ist wieder Raum.</translation>
    </message>
    <message>
        <source>%1: done</source>
        <translation>%1: fertig</translation>
    </message>
    <message>
        <source>%1: stopped</source>
        <translation>%1: abgebrochen</translation>
    </message>
    <message>
        <source>%1: nothing to do</source>
        <translation>%1: nichts zu tun</translation>
    </message>
    <message>
        <source>Working on the slabs: %1 %. You can go on sculpting.</source>
        <translation>Arbeit an den Platten: %1 %. Sie können weiterarbeiten.</translation>
    </message>
    <message>
        <source>Export the model</source>
        <translation>Modell exportieren</translation>
    </message>
    <message>
        <source>PLY (*.ply);;STL (*.stl);;OBJ (*.obj);;glTF (*.glb);;3MF (*.3mf);;Slabs as text (*.slabs)</source>
        <translation>PLY (*.ply);;STL (*.stl);;OBJ (*.obj);;glTF (*.glb);;3MF (*.3mf);;Platten als Text (*.slabs)</translation>
    </message>
    <message>
        <source>The model could not be exported</source>
        <translation>Das Modell konnte nicht exportiert werden</translation>
    </message>
    <message>
        <source>The tool leaves the surface on the way to %1: what it does there is left out.</source>
        <translation>Auf dem Weg nach %1 ist das Werkzeug nicht an der Oberfläche: Was es dort tut, entfällt.</translation>
    </message>
    <message>
        <source>The fibres lean at %1: the tool takes some clay from beside it, too.</source>
        <translation>Bei %1 stehen die Fasern schräg: Das Werkzeug nimmt auch neben sich etwas Ton weg.</translation>
    </message>
    <message>
        <source>load import file scan</source>
        <translation>laden importieren Datei Scan</translation>
    </message>
    <message>
        <source>write store</source>
        <translation>schreiben sichern</translation>
    </message>
    <message>
        <source>write mesh stl obj ply glb 3mf print</source>
        <translation>schreiben Netz STL OBJ PLY GLB 3MF drucken</translation>
    </message>
    <message>
        <source>screenshot image render png</source>
        <translation>Bildschirmfoto Foto rendern PNG</translation>
    </message>
    <message>
        <source>film video animation</source>
        <translation>Film Video Animation</translation>
    </message>
    <message>
        <source>summary protocol html</source>
        <translation>Zusammenfassung Protokoll HTML</translation>
    </message>
    <message>
        <source>exit leave program</source>
        <translation>verlassen schließen Programm</translation>
    </message>
    <message>
        <source>settings options language shortcuts</source>
        <translation>Optionen Voreinstellungen Sprache Tastenkürzel</translation>
    </message>
    <message>
        <source>back revert</source>
        <translation>zurück widerrufen</translation>
    </message>
    <message>
        <source>again repeat</source>
        <translation>wieder nochmals</translation>
    </message>
    <message>
        <source>clay ends extend remesh</source>
        <translation>Ton endet erweitern</translation>
    </message>
    <message>
        <source>subdivide detail resolution</source>
        <translation>unterteilen Details Auflösung</translation>
    </message>
    <message>
        <source>remesh rebuild convert</source>
        <translation>neu vernetzen umwandeln</translation>
    </message>
    <message>
        <source>brush size</source>
        <translation>Pinsel Größe</translation>
    </message>
    <message>
        <source>brush intensity</source>
        <translation>Pinsel Intensität</translation>
    </message>
    <message>
        <source>brush size smaller</source>
        <translation>Pinsel Größe verkleinern</translation>
    </message>
    <message>
        <source>brush size bigger</source>
        <translation>Pinsel Größe vergrößern</translation>
    </message>
    <message>
        <source>mirror</source>
        <translation>spiegeln</translation>
    </message>
    <message>
        <source>eyedropper pipette sample</source>
        <translation>Pipette aufnehmen</translation>
    </message>
    <message>
        <source>zoom fit reset home centre</source>
        <translation>Zoom einpassen zurücksetzen mitte</translation>
    </message>
    <message>
        <source>orthographic projection camera</source>
        <translation>orthografisch Projektion Kamera</translation>
    </message>
    <message>
        <source>upright orientation rotate stand</source>
        <translation>aufrecht Ausrichtung drehen stellen</translation>
    </message>
    <message>
        <source>wireframe edges grid</source>
        <translation>Drahtgitter Kanten Netz</translation>
    </message>
    <message>
        <source>displacement height colours</source>
        <translation>Verschiebung Höhe Farben</translation>
    </message>
    <message>
        <source>hollows ambient occlusion</source>
        <translation>Mulden Umgebungsverdeckung</translation>
    </message>
    <message>
        <source>shadows quality lighting</source>
        <translation>Schatten Qualität Beleuchtung</translation>
    </message>
    <message>
        <source>refresh repaint</source>
        <translation>aktualisieren auffrischen</translation>
    </message>
    <message>
        <source>sidebar docks interface</source>
        <translation>Seitenleiste Oberfläche</translation>
    </message>
    <message>
        <source>maximise window</source>
        <translation>maximieren Fenster</translation>
    </message>
    <message>
        <source>theme dark mode light mode appearance night</source>
        <translation>Thema Design Dunkelmodus Hellmodus dunkler Modus heller Modus Aussehen Nacht</translation>
    </message>
    <message>
        <source>More</source>
        <translation>Mehr</translation>
    </message>
    <message>
        <source>Shows what has no room in the bar</source>
        <translation>Zeigt, was in der Leiste keinen Platz hat</translation>
    </message>
    <message>
        <source>More tools</source>
        <translation>Weitere Werkzeuge</translation>
    </message>
    <message>
        <source>Shows the tools that have no room in the column</source>
        <translation>Zeigt die Werkzeuge, die in der Spalte keinen Platz haben</translation>
    </message>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>Layers</source>
        <translation>Ebenen</translation>
    </message>
    <message>
        <source>Repeat the last stroke</source>
        <translation>Letzten Strich wiederholen</translation>
    </message>
    <message>
        <source>once more same again</source>
        <translation>noch einmal nochmal gleicher wiederholen</translation>
    </message>
    <message>
        <source>The stroke was taken back.</source>
        <translation>Der Strich wurde zurückgenommen.</translation>
    </message>
    <message>
        <source>Making room under the stroke … Esc takes the stroke back.</source>
        <translation>Unter dem Strich wird Platz geschaffen … Esc nimmt den Strich zurück.</translation>
    </message>
    <message>
        <source>Making room under the stroke: %1 %. Esc takes the stroke back.</source>
        <translation>Unter dem Strich wird Platz geschaffen: %1 %. Esc nimmt den Strich zurück.</translation>
    </message>
    <message>
        <source>Making room under the stroke …</source>
        <translation>Unter dem Strich wird Platz geschaffen …</translation>
    </message>
    <message>
        <source>Turn the view left</source>
        <translation>Ansicht nach links drehen</translation>
    </message>
    <message>
        <source>Turn the view right</source>
        <translation>Ansicht nach rechts drehen</translation>
    </message>
    <message>
        <source>Turn the view up</source>
        <translation>Ansicht nach oben drehen</translation>
    </message>
    <message>
        <source>Turn the view down</source>
        <translation>Ansicht nach unten drehen</translation>
    </message>
    <message>
        <source>%1: done; the surface moved by at most %2</source>
        <translation>%1: fertig; die Oberfläche hat sich um höchstens %2 bewegt</translation>
    </message>
    <message>
        <source>The form is %1 thick at %2. A stroke goes to about its middle, for slabs cannot have holes.</source>
        <translation>Bei %2 ist die Form %1 dick. Ein Strich reicht bis etwa zu ihrer Mitte, denn Platten können keine Löcher haben.</translation>
    </message>
    <message>
        <source>Another part of the form is %1 away from %2. A stroke grows to about the middle.</source>
        <translation>Ein anderer Teil der Form ist %1 von %2 entfernt. Ein Strich wächst bis etwa zur Mitte.</translation>
    </message>
    <message>
        <source>The tool goes %1 under the surface at %2. Slabs cannot hold undercuts: the clay above goes, too.</source>
        <translation>Bei %2 geht das Werkzeug %1 unter die Oberfläche. Platten können keine Hinterschneidungen halten: Der Ton darüber geht mit.</translation>
    </message>
    <message>
        <source>The clay ends at %2: the tool goes %1 under the surface, and slabs cannot hold undercuts.</source>
        <translation>Der Ton endet bei %2: Das Werkzeug geht %1 unter die Oberfläche, und Platten können keine Hinterschneidungen halten.</translation>
    </message>
    <message>
        <source>The clay ends at %1: no further in this direction.</source>
        <translation>Bei %1 ist der Ton zu Ende: in dieser Richtung geht es nicht weiter.</translation>
    </message>
    <message>
        <source>The surface stays coarser at %1 than this tool wants. A larger radius helps.</source>
        <translation>Die Oberfläche bleibt bei %1 gröber, als dieses Werkzeug sie braucht. Ein größerer Radius hilft.</translation>
    </message>
    <message>
        <source>There is more room now, but at %1 not as much as the stroke wants.</source>
        <translation>Jetzt ist mehr Raum, aber bei %1 nicht so viel, wie der Strich braucht.</translation>
    </message>
</context>
<context>
    <name>relief::studio::NavigationCard</name>
    <message>
        <source>How do you turn the view?</source>
        <translation>Wie soll sich die Ansicht drehen lassen?</translation>
    </message>
    <message>
        <source>Middle button</source>
        <translation>Mittlere Taste</translation>
    </message>
    <message>
        <source>as in Blender; Shift moves</source>
        <translation>wie in Blender; Shift verschiebt</translation>
    </message>
    <message>
        <source>Alt and left button</source>
        <translation>Alt und linke Taste</translation>
    </message>
    <message>
        <source>as in film and CAD; middle moves</source>
        <translation>wie in Film und CAD; die mittlere verschiebt</translation>
    </message>
    <message>
        <source>Beside the model</source>
        <translation>Neben dem Modell</translation>
    </message>
    <message>
        <source>with a pen; Shift moves</source>
        <translation>mit dem Stift; Shift verschiebt</translation>
    </message>
    <message>
        <source>The wheel always zooms. This can be changed later under Edit, Preferences.</source>
        <translation>Das Rad vergrößert immer. Ändern lässt sich das später unter Bearbeiten, Einstellungen.</translation>
    </message>
</context>
<context>
    <name>relief::studio::PlotView</name>
    <message>
        <source>Freeze it, then drag or use the arrows to read a moment.</source>
        <translation>Anhalten, dann ziehen oder Pfeiltasten nehmen, um einen Augenblick abzulesen.</translation>
    </message>
    <message>
        <source>%1, %2 s before</source>
        <translation>%1, %2 s davor</translation>
    </message>
</context>
<context>
    <name>relief::studio::PreferencesDialog</name>
    <message>
        <source>Preferences</source>
        <translation>Einstellungen</translation>
    </message>
    <message>
        <source>Search in the preferences</source>
        <translation>In den Einstellungen suchen</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>Suchen</translation>
    </message>
    <message>
        <source>Pages</source>
        <translation>Seiten</translation>
    </message>
    <message>
        <source>Nothing of that name.</source>
        <translation>Nichts dieses Namens.</translation>
    </message>
    <message>
        <source>Back to defaults</source>
        <translation>Zurück zur Vorgabe</translation>
    </message>
    <message>
        <source>All of the page “%1”</source>
        <translation>Die ganze Seite „%1“</translation>
    </message>
    <message>
        <source>Choose …</source>
        <translation>Wählen …</translation>
    </message>
    <message>
        <source>Choose: %1</source>
        <translation>Wählen: %1</translation>
    </message>
    <message>
        <source>Look</source>
        <translation>Aussehen</translation>
    </message>
    <message>
        <source>Theme</source>
        <translation>Farben</translation>
    </message>
    <message>
        <source>“Like the desktop” is dark where the desktop does not say.</source>
        <translation>„Wie der Desktop“ ist dunkel, wo der Desktop nichts angibt.</translation>
    </message>
    <message>
        <source>Like the desktop</source>
        <translation>Wie der Desktop</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>Dunkel</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>Hell</translation>
    </message>
    <message>
        <source>Text size</source>
        <translation>Schriftgröße</translation>
    </message>
    <message>
        <source>Of all words and of what is around them.</source>
        <translation>Aller Wörter und dessen, was um sie herum ist.</translation>
    </message>
    <message>
        <source>Less motion</source>
        <translation>Weniger Bewegung</translation>
    </message>
    <message>
        <source>Nothing slides, fades or turns by itself.</source>
        <translation>Nichts gleitet, blendet oder dreht sich von selbst.</translation>
    </message>
    <message>
        <source>Input</source>
        <translation>Eingabe</translation>
    </message>
    <message>
        <source>Navigation</source>
        <translation>Navigation</translation>
    </message>
    <message>
        <source>Which buttons turn, move and zoom the view.</source>
        <translation>Mit welchen Tasten die Ansicht gedreht, verschoben und vergrößert wird.</translation>
    </message>
    <message>
        <source>Blender: middle button</source>
        <translation>Blender: mittlere Taste</translation>
    </message>
    <message>
        <source>Industry: Alt and a button</source>
        <translation>Industrie: Alt und eine Taste</translation>
    </message>
    <message>
        <source>Pen: beside the model</source>
        <translation>Stift: neben dem Modell</translation>
    </message>
    <message>
        <source>Turn like on a turntable</source>
        <translation>Wie auf einem Drehteller drehen</translation>
    </message>
    <message>
        <source>What is up stays up. Without it, the model turns freely in all directions.</source>
        <translation>Was oben ist, bleibt oben. Sonst dreht sich das Modell frei in alle Richtungen.</translation>
    </message>
    <message>
        <source>Use the pressure of the pen</source>
        <translation>Druck des Stifts verwenden</translation>
    </message>
    <message>
        <source>Without it, a pen works like a mouse: always at full pressure.</source>
        <translation>Sonst wirkt ein Stift wie eine Maus: immer mit vollem Druck.</translation>
    </message>
    <message>
        <source>Single keys choose tools</source>
        <translation>Einzelne Tasten wählen Werkzeuge</translation>
    </message>
    <message>
        <source>Off, keys act with Ctrl or Alt only: for people who speak their words, or whose hands tremble.</source>
        <translation>Ausgeschaltet wirken Tasten nur mit Strg oder Alt: für Menschen, die diktieren oder deren Hände zittern.</translation>
    </message>
    <message>
        <source>Drawing</source>
        <translation>Zeichnen</translation>
    </message>
    <message>
        <source>Drawn by</source>
        <translation>Gezeichnet von</translation>
    </message>
    <message>
        <source>Smooth edges at rest</source>
        <translation>Glatte Kanten in Ruhe</translation>
    </message>
    <message>
        <source>How often each point is drawn when nothing moves: more is finer, and takes longer.</source>
        <translation>Wie oft jeder Punkt gezeichnet wird, wenn sich nichts bewegt: mehr ist feiner und dauert länger.</translation>
    </message>
    <message>
        <source>Off</source>
        <translation>Aus</translation>
    </message>
    <message>
        <source>4 times</source>
        <translation>4-mal</translation>
    </message>
    <message>
        <source>16 times</source>
        <translation>16-mal</translation>
    </message>
    <message>
        <source>Saving</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Every finished stroke is saved at once. There is nothing to switch on.</source>
        <translation>Jeder fertige Strich wird sofort gespeichert. Einzuschalten ist nichts.</translation>
    </message>
    <message>
        <source>Pictures and films</source>
        <translation>Bilder und Filme</translation>
    </message>
    <message>
        <source>Where F12 puts them.</source>
        <translation>Wohin F12 sie legt.</translation>
    </message>
    <message>
        <source>Models without a name</source>
        <translation>Modelle ohne Namen</translation>
    </message>
    <message>
        <source>Where they lie until you name them. Models that are there already stay where they are.</source>
        <translation>Wo sie liegen, bis sie benannt werden. Vorhandene Modelle bleiben, wo sie sind.</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>Sprache</translation>
    </message>
    <message>
        <source>The window is built anew; your model stays open.</source>
        <translation>Das Fenster wird neu aufgebaut; das Modell bleibt offen.</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Forces</source>
        <translation>Kräfte</translation>
    </message>
    <message>
        <source>Most force</source>
        <translation>Größte Kraft</translation>
    </message>
    <message>
        <source>Of what the device can give. Less is kinder to a hand that is new to it; the device panel sets less still, never more.</source>
        <translation>Von dem, was das Gerät geben kann. Weniger ist freundlicher zu einer Hand, die es noch nicht kennt; im Geräte-Bereich lässt sich noch weniger einstellen, nie mehr.</translation>
    </message>
    <message>
        <source>Sound of the contact</source>
        <translation>Klang der Berührung</translation>
    </message>
    <message>
        <source>Lets people beside you hear what the tool does to the clay.</source>
        <translation>Lässt auch andere hören, was das Werkzeug mit dem Ton macht.</translation>
    </message>
    <message>
        <source>These limits always hold on a real device, for the sake of the hand and of the motors:</source>
        <translation>Diese Grenzen gelten an einem echten Gerät immer, der Hand und den Motoren zuliebe:</translation>
    </message>
    <message>
        <source>A force grows gently</source>
        <translation>Eine Kraft wächst sanft</translation>
    </message>
    <message>
        <source>It may end at once, but never begins with a blow.</source>
        <translation>Sie darf sofort enden, beginnt aber nie mit einem Schlag.</translation>
    </message>
    <message>
        <source>A late or lost device gets none</source>
        <translation>Ein Gerät, das zu spät oder gar nicht antwortet, bekommt keine</translation>
    </message>
    <message>
        <source>A fast hand is braked</source>
        <translation>Eine schnelle Hand wird gebremst</translation>
    </message>
    <message>
        <source>Warm motors get less</source>
        <translation>Warme Motoren bekommen weniger</translation>
    </message>
    <message>
        <source>Most devices bear their greatest force for seconds only.</source>
        <translation>Die meisten Geräte halten ihre größte Kraft nur Sekunden aus.</translation>
    </message>
    <message>
        <source>Pause, or Escape twice, ends all forces</source>
        <translation>Pause, oder zweimal Escape, beendet alle Kräfte</translation>
    </message>
    <message>
        <source>They come back only when you ask for them.</source>
        <translation>Sie kommen erst wieder, wenn Sie es verlangen.</translation>
    </message>
    <message>
        <source>A force that comes late pushes where the hand no longer is.</source>
        <translation>Eine verspätete Kraft drückt dort, wo die Hand nicht mehr ist.</translation>
    </message>
    <message>
        <source>A hand that slips off is slowed.</source>
        <translation>Eine Hand, die abrutscht, wird langsamer.</translation>
    </message>
    <message>
        <source>A pen works with less pressure the flatter it lies: with half of it at 60 degrees.</source>
        <translation>Ein Stift arbeitet mit weniger Druck, je flacher er liegt: bei 60 Grad mit der Hälfte.</translation>
    </message>
    <message>
        <source>Use the tilt of the pen</source>
        <translation>Die Neigung des Stifts nutzen</translation>
    </message>
</context>
<context>
    <name>relief::studio::ProgressStrip</name>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Convert progress</source>
        <translation>Fortschritt der Umwandlung</translation>
    </message>
    <message>
        <source>Stops the work and leaves everything as it was before.</source>
        <translation>Hält die Arbeit an und lässt alles, wie es war.</translation>
    </message>
    <message>
        <source>About %1 min left</source>
        <translation>Noch etwa %1 min</translation>
    </message>
    <message>
        <source>About %1 s left</source>
        <translation>Noch etwa %1 s</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>Stopping …</source>
        <translation>Wird angehalten …</translation>
    </message>
</context>
<context>
    <name>relief::studio::Shelf</name>
    <message>
        <source>The list of recent models could not be read. It is now %1.</source>
        <translation>Die Liste der letzten Modelle war nicht lesbar. Sie heißt jetzt %1.</translation>
    </message>
</context>
<context>
    <name>relief::studio::SplitView</name>
    <message>
        <source>Analysis view</source>
        <translation>Analyseansicht</translation>
    </message>
</context>
<context>
    <name>relief::studio::StartPage</name>
    <message>
        <source>Start page</source>
        <translation>Startseite</translation>
    </message>
    <message>
        <source>Recover</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Drop a scan here</source>
        <translation>Scan hierher ziehen</translation>
    </message>
    <message>
        <source>Or try a sample</source>
        <translation>Oder ein Beispiel ausprobieren</translation>
    </message>
    <message>
        <source>Makes the sample model and opens it</source>
        <translation>Erzeugt das Beispielmodell und öffnet es</translation>
    </message>
    <message>
        <source>Recent</source>
        <translation>Zuletzt</translation>
    </message>
    <message numerus="yes">
        <source>%n stroke(s)</source>
        <translation>
            <numerusform>%n Strich</numerusform>
            <numerusform>%n Striche</numerusform>
        </translation>
    </message>
    <message>
        <source>Without a name yet; kept by the program</source>
        <translation>Noch ohne Namen; das Programm bewahrt es auf</translation>
    </message>
    <message>
        <source>What can I do here?</source>
        <translation>Was kann ich hier tun?</translation>
    </message>
    <message>
        <source>Sculpt</source>
        <translation>Modellieren</translation>
    </message>
    <message>
        <source>Drag on the model to carve. Shift smooths, Ctrl builds up. F and a drag set the size.</source>
        <translation>Auf dem Modell ziehen trägt ab. Shift glättet, Strg trägt auf. F und Ziehen stellen die Größe ein.</translation>
    </message>
    <message>
        <source>Look around</source>
        <translation>Umsehen</translation>
    </message>
    <message>
        <source>Drag beside the model to turn it. The wheel zooms, Home shows all of it.</source>
        <translation>Neben dem Modell ziehen dreht es. Das Rad vergrößert, Pos1 zeigt alles.</translation>
    </message>
    <message>
        <source>Feel</source>
        <translation>Fühlen</translation>
    </message>
    <message>
        <source>With a haptic device, or the mouse as a probe: choose it at the upper right.</source>
        <translation>Mit einem haptischen Gerät oder der Maus als Taster: oben rechts wählen.</translation>
    </message>
    <message numerus="yes">
        <source>It was open when the program ended. All %n finished stroke(s) are in it, the last one from %1.</source>
        <translation>
            <numerusform>Es war offen, als das Programm endete. Der eine fertige Strich ist darin, von %1.</numerusform>
            <numerusform>Es war offen, als das Programm endete. Alle %n fertigen Striche sind darin, der letzte von %1.</numerusform>
        </translation>
    </message>
    <message>
        <source>%1 can be opened again</source>
        <translation>%1 kann wieder geöffnet werden</translation>
    </message>
</context>
<context>
    <name>relief::studio::Swatch</name>
    <message>
        <source>Paint with %1.</source>
        <translation>Mit %1 malen.</translation>
    </message>
</context>
<context>
    <name>relief::studio::ToolPanel</name>
    <message>
        <source>Tool settings</source>
        <translation>Werkzeugeinstellungen</translation>
    </message>
    <message>
        <source>Mirror</source>
        <translation>Spiegeln</translation>
    </message>
    <message>
        <source>Mirror %1</source>
        <translation>Spiegeln %1</translation>
    </message>
    <message>
        <source>Use pressure</source>
        <translation>Druck verwenden</translation>
    </message>
    <message>
        <source>Whether a pen&apos;s pressure drives the tool</source>
        <translation>Ob der Druck eines Stifts das Werkzeug steuert</translation>
    </message>
    <message>
        <source>Mouse: no pressure</source>
        <translation>Maus: kein Druck</translation>
    </message>
    <message>
        <source>Tilt lightens</source>
        <translation>Neigung macht leichter</translation>
    </message>
    <message>
        <source>Whether a pen works with less pressure the flatter it lies</source>
        <translation>Ob ein Stift mit weniger Druck arbeitet, je flacher er liegt</translation>
    </message>
</context>
<context>
    <name>relief::studio::TurntableDialog</name>
    <message>
        <source>Save a turntable</source>
        <translation>Drehteller-Film speichern</translation>
    </message>
    <message>
        <source>Pictures</source>
        <translation>Bilder</translation>
    </message>
    <message>
        <source>Length</source>
        <translation>Länge</translation>
    </message>
    <message>
        <source>Turn</source>
        <translation>Drehung</translation>
    </message>
    <message>
        <source>As the view: %1 × %2</source>
        <translation>Wie die Ansicht: %1 × %2</translation>
    </message>
    <message>
        <source>Size</source>
        <translation>Größe</translation>
    </message>
    <message>
        <source>Name</source>
        <translation>Name</translation>
    </message>
    <message>
        <source>Folder</source>
        <translation>Ordner</translation>
    </message>
    <message>
        <source>Choose …</source>
        <translation>Wählen …</translation>
    </message>
    <message>
        <source>Pictures drawn</source>
        <translation>Gezeichnete Bilder</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>%1 pictures a second</source>
        <translation>%1 Bilder in der Sekunde</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>The folder %1 cannot be made. Choose another one.</source>
        <translation>Der Ordner %1 lässt sich nicht anlegen. Bitte einen anderen wählen.</translation>
    </message>
</context>
<context>
    <name>relief::studio::ValueBar</name>
    <message>
        <source>Drag to change, with Shift finely. Double click or Enter to type.</source>
        <translation>Ziehen ändert, mit Shift fein. Doppelklick oder Enter zum Tippen.</translation>
    </message>
    <message>
        <source>%1, type a value</source>
        <translation>%1, Wert eingeben</translation>
    </message>
    <message>
        <source>&quot;%1&quot; is not a value here. Type for example %2.</source>
        <translation>„%1“ ist hier kein Wert. Zum Beispiel %2 eingeben.</translation>
    </message>
</context>
<context>
    <name>relief::studio::Viewport</name>
    <message>
        <source>Viewport</source>
        <translation>Ansichtsfenster</translation>
    </message>
    <message>
        <source>There is no stroke to repeat yet.</source>
        <translation>Es gibt noch keinen Strich zu wiederholen.</translation>
    </message>
    <message>
        <source>The last stroke cannot be repeated here.</source>
        <translation>Der letzte Strich lässt sich hier nicht wiederholen.</translation>
    </message>
    <message>
        <source>Touch leaves no trace. Choose another tool to repeat the last stroke.</source>
        <translation>Tasten hinterlässt keine Spur. Wählen Sie ein anderes Werkzeug, um den letzten Strich zu wiederholen.</translation>
    </message>
</context>
</TS>
