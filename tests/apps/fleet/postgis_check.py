#!/usr/bin/env python3
"""Compares the catalogue in a database, as psql reads it, with a GeoPackage of the same drives, as SQLite reads it: columns, types and every value.

usage: postgis_check.py FLEET.gpkg SOCKET_FOLDER DATABASE
"""
import datetime, json, sqlite3, subprocess, sys

path, server, database = sys.argv[1:]
base = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
base.row_factory = sqlite3.Row


def ask(sql):
    done = subprocess.run(["psql", "-XAtq", "-v", "ON_ERROR_STOP=1", "-h", server, "-U", "boss", "-d", database, "-c", "SET timezone = 'UTC'", "-c", sql],
                          check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


types = {"TEXT": "text", "INTEGER": "bigint", "DOUBLE": "double precision", "DATETIME": "timestamp with time zone", "LINESTRING": "geometry(LineString,4326)"}
for table in "drives", "products":
    wanted = {row["name"]: types[row["type"]] for row in base.execute(f"PRAGMA table_info({table})")}
    found = dict(ask(f"SELECT json_agg(json_build_array(attname, format_type(atttypid, atttypmod))) FROM pg_attribute WHERE attrelid = '{table}'::regclass AND attnum > 0 AND NOT attisdropped"))
    if table == "drives":
        assert found.pop("key") == "text"
    assert found == wanted, (found, wanted)
indexes = ask("SELECT json_agg(indexdef) FROM pg_indexes WHERE tablename = 'drives'")
assert any("USING gist (line)" in one for one in indexes), indexes

drives = ask("SELECT json_agg(row_to_json(d)) FROM (SELECT *, encode(ST_AsBinary(line, 'NDR'), 'hex') AS wkb FROM drives ORDER BY fid) d")
products = ask("SELECT coalesce(json_agg(row_to_json(p)), '[]') FROM products p")
rows = base.execute("SELECT * FROM drives ORDER BY fid").fetchall()
assert len(rows) == len(drives), (len(rows), len(drives))
by_place = {(one["recording"], one["results"]): one for one in drives}
assert len(by_place) == len(rows)
for row in rows:
    drive = by_place[row["recording"], row["results"]]
    for column in row.keys():
        wanted, found = row[column], drive[column]
        if column == "fid":
            continue
        if column == "line":
            wanted, found = wanted and wanted[40:].hex(), drive["wkb"]  # behind the GeoPackage's header: the same well-known binary
        elif column.endswith("_utc") and wanted:
            wanted, found = (datetime.datetime.fromisoformat(text) for text in (wanted, found))
        assert wanted == found, (row["name"], column, wanted, found)
    files = base.execute("SELECT file, bytes, sha256 FROM products WHERE drive_fid = ?", (row["fid"],))
    assert sorted(map(tuple, files)) == sorted((one["file"], one["bytes"], one["sha256"]) for one in products if one["drive_fid"] == drive["fid"]), row["name"]
assert len(products) == base.execute("SELECT count(*) FROM products").fetchone()[0]
assert any(one["wkb"] for one in drives)
