<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="en">
<context>
    <name>OpenJob</name>
    <message numerus="yes">
        <source>%n opening(s) stay open</source>
        <translation>
            <numerusform>%n opening stays open</numerusform>
            <numerusform>%n openings stay open</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n small part(s) were left out</source>
        <translation>
            <numerusform>%n small part was left out</numerusform>
            <numerusform>%n small parts were left out</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n tiny component(s) were left out</source>
        <translation>
            <numerusform>%n tiny component was left out</numerusform>
            <numerusform>%n tiny components were left out</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n triangle(s) were mended</source>
        <translation>
            <numerusform>%n triangle was mended</numerusform>
            <numerusform>%n triangles were mended</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n component(s) far off were left out</source>
        <translation>
            <numerusform>%n component far off was left out</numerusform>
            <numerusform>%n components far off were left out</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n triangle(s) inside of other parts were left out</source>
        <translation>
            <numerusform>%n triangle inside of other parts was left out</numerusform>
            <numerusform>%n triangles inside of other parts were left out</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n point(s) moved by at most %1</source>
        <translation>
            <numerusform>%n point moved by at most %1</numerusform>
            <numerusform>%n points moved by at most %1</numerusform>
        </translation>
    </message>
</context>
<context>
    <name>SessionReport</name>
    <message numerus="yes">
        <source>%n stroke(s) are not in the file yet.</source>
        <translation>
            <numerusform>%n stroke is not in the file yet.</numerusform>
            <numerusform>%n strokes are not in the file yet.</numerusform>
        </translation>
    </message>
</context>
<context>
    <name>Text</name>
    <message numerus="yes">
        <source>%n minute(s) ago</source>
        <translation>
            <numerusform>%n minute ago</numerusform>
            <numerusform>%n minutes ago</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n hour(s) ago</source>
        <translation>
            <numerusform>%n hour ago</numerusform>
            <numerusform>%n hours ago</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n day(s) ago</source>
        <translation>
            <numerusform>%n day ago</numerusform>
            <numerusform>%n days ago</numerusform>
        </translation>
    </message>
</context>
<context>
    <name>relief::studio::HistoryPanel</name>
    <message numerus="yes">
        <source>%n earlier stroke(s)</source>
        <translation>
            <numerusform>%n earlier stroke</numerusform>
            <numerusform>%n earlier strokes</numerusform>
        </translation>
    </message>
</context>
<context>
    <name>relief::studio::MainWindow</name>
    <message numerus="yes">
        <source>%n old step(s) can no more be undone.</source>
        <translation>
            <numerusform>%n old step can no more be undone.</numerusform>
            <numerusform>%n old steps can no more be undone.</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n slab(s)</source>
        <translation>
            <numerusform>%n slab</numerusform>
            <numerusform>%n slabs</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n stroke(s) could not be saved yet: %1. You can go on; it is tried again every ten seconds.</source>
        <translation>
            <numerusform>%n stroke could not be saved yet: %1. You can go on; it is tried again every ten seconds.</numerusform>
            <numerusform>%n strokes could not be saved yet: %1. You can go on; it is tried again every ten seconds.</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n picture(s) saved in %1</source>
        <translation>
            <numerusform>%n picture saved in %1</numerusform>
            <numerusform>%n pictures saved in %1</numerusform>
        </translation>
    </message>
</context>
<context>
    <name>relief::studio::StartPage</name>
    <message numerus="yes">
        <source>%n stroke(s)</source>
        <translation>
            <numerusform>%n stroke</numerusform>
            <numerusform>%n strokes</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>It was open when the program ended. All %n finished stroke(s) are in it, the last one from %1.</source>
        <translation>
            <numerusform>It was open when the program ended. Its one finished stroke is in it, from %1.</numerusform>
            <numerusform>It was open when the program ended. All %n finished strokes are in it, the last one from %1.</numerusform>
        </translation>
    </message>
</context>
</TS>
