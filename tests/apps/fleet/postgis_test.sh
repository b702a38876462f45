#!/usr/bin/env bash
# The catalogue of a fleet in a real PostgreSQL with PostGIS: the values of the GeoPackage; drives that are replaced while others stay; two
# writers at once; a server that is killed in the middle; and what a user gets wrong, each told in a sentence without the password.
# usage: postgis_test.sh HUELINE IMAGE_PROOF SOURCE_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3
work=$(mktemp -d)
server=$work/server
source "$source/tests/apps/program.sh"
source "$source/tests/apps/fleet/drives.sh"
source "$source/tests/apps/fleet/postgres.sh"
trap 'stop_postgres || true; rm -rf "$work"' EXIT
chmod 755 "$work"  # the server runs as another user
cd "$work"
unset "${!PG@}"
has_postgres || { echo "SKIPPED: PostgreSQL or PostGIS is not installed (postgresql-15, postgresql-15-postgis-3)"; exit 77; }
start_postgres || fail "no server: $(cat why.txt)"

at() { echo "postgresql://$1@/$2?host=$server${3:+&$3}"; }
fleet=$(at boss fleet)
# catalogue STATUS URL [DRIVE...]: of the plan, if nothing else is named. What is said is kept, to be searched for passwords.
catalogue() {
  local want=$1 url=$2; shift 2
  [ $# -gt 0 ] || set -- fleet.json
  ends "$want" timeout 60 "$hueline" fleet catalogue "$@" --out "$url"
  cat said.txt >>told.txt
}
# rows: every value of both tables
rows() { sql fleet "SELECT * FROM drives ORDER BY fid" "SELECT * FROM products ORDER BY fid"; }
same_as_geopackage() { ends 0 "$hueline" fleet catalogue "$@" --out same.gpkg; "$source/tests/apps/fleet/postgis_check.py" same.gpkg "$server" fleet || fail "not the GeoPackage's: $*"; }
empty() { sql fleet "DROP TABLE products, drives"; }

make_drives 3
mkdir "drives/it's \$4"
cp drives/3/drive.mcap "drives/it's \$4"
ends 0 "$hueline" fleet plan drives/* --out fleet.json
ends 0 "$hueline" fleet run fleet.json --jobs 2

# A database that lacks something, asked before anything is read.
catalogue 4 "$fleet" nothing.json
says 'postgresql://boss@/fleet\?host=.*database "fleet" does not exist$'
sql postgres "CREATE DATABASE fleet"
catalogue 4 "$fleet"
says "the database has no PostGIS; have its administrator run CREATE EXTENSION postgis$"
sql fleet "CREATE EXTENSION postgis"
catalogue 3 "$fleet" nothing.json
[ -z "$(sql fleet "SELECT to_regclass('drives')")" ] || fail "tables without a catalogue"

# Written twice, the rows are the same, with the GeoPackage's values. GDAL reads them.
catalogue 0 "$fleet"
says "^4 drives in postgresql://boss@/fleet\?host=.*: 4 new, 0 replaced$"
same_as_geopackage fleet.json
rows >first.txt
catalogue 0 "postgres${fleet#postgresql}"
says ": 0 new, 4 replaced$"
rows >second.txt
cmp first.txt second.txt || fail "the rows change"
told=$(ogrinfo -ro -so "PG:host=$server user=boss dbname=fleet" drives 2>&1)
for one in "Geometry: Line String" "Feature Count: 4" "FID Column = fid" "begin_utc: DateTime" "points: Integer64" 'ID\["EPSG",4326\]'; do
  grep -q "$one" <<<"$told" || fail "GDAL reads no $one: $told"
done

# Another plan and drives without one come beside them; a plan that has gone on replaces its own rows. What others have added stays.
sql fleet "ALTER TABLE drives ADD remark text" "UPDATE drives SET remark = 'kept' WHERE name = '3'"
ends 0 "$hueline" fleet plan drives/1 drives/2 --out better.json
ends 0 "$hueline" fleet run better.json
catalogue 0 "$fleet" better.json drives/1
says ": 3 new, 0 replaced$"
mv fleet/3 kept
catalogue 0 "$fleet"
says ": 0 new, 4 replaced$"
[ "$(sql fleet "SELECT status, remark, fid, (SELECT count(*) FROM products WHERE drive_fid = d.fid) FROM drives d WHERE name = '3'")" = "open|kept|3|0" ] || fail "the drive was not replaced: $(rows)"
mv kept fleet/3
catalogue 0 "$fleet"
sql fleet "ALTER TABLE drives DROP remark"
same_as_geopackage fleet.json better.json drives/1
# A file that the results have no more.
sql fleet "INSERT INTO products (drive_fid, file) SELECT min(fid), 'old.las' FROM drives UNION SELECT max(fid), 'other.las' FROM drives"
catalogue 0 "$fleet"
[ "$(sql fleet "SELECT file FROM products WHERE bytes IS NULL")" = other.las ] || fail "files: $(rows)"
# Named twice, it is one drive.
catalogue 0 "$fleet" fleet.json fleet.json
says ": 0 new, 4 replaced$"

# Writers at once, in tables that nobody has made yet, with the same drives in another order.
for ((round = 0; round < 5; round++)); do
  empty
  writers=()
  for drives in "fleet.json better.json" "better.json drives/1 fleet.json" "drives/1 fleet.json" "fleet.json"; do
    "$hueline" fleet catalogue $drives --out "$fleet" >"writer${#writers[@]}.txt" 2>&1 & writers+=($!)
  done
  for ((i = 0; i < 4; i++)); do wait "${writers[i]}" || fail "writer $i: $(cat "writer$i.txt")"; done
  same_as_geopackage fleet.json better.json drives/1
done

# Killed in the middle: a trigger holds the third drive.
empty
catalogue 0 "$fleet" drives/1
rows >before.txt
sql fleet "CREATE FUNCTION hold() RETURNS trigger LANGUAGE plpgsql AS \$\$BEGIN IF NEW.name = '3' THEN PERFORM pg_sleep(100); END IF; RETURN NEW; END\$\$" \
  "CREATE TRIGGER hold BEFORE INSERT ON drives FOR EACH ROW EXECUTE FUNCTION hold()"
"$hueline" fleet catalogue drives/1 fleet.json --out "$fleet" >said.txt 2>&1 & writer=$!
holds() { [ "$(sql fleet "SELECT count(*) FROM pg_stat_activity WHERE wait_event = 'PgSleep' AND application_name = 'hueline'")" = 1 ]; }
for ((i = 0; i < 300; i++)); do holds && break; sleep 0.1; done
holds || fail "nothing was written"
stop_postgres
status=0; wait $writer || status=$?
[ $status = 4 ] || fail "status $status after the server was killed"
says "the connection was lost: .* \(drive 3\); nothing was changed$"
[ "$(grep -cvE "^[0-9:]+ info the database says: " said.txt)" = 1 ] || fail "more than one error"
catalogue 4 "$fleet"
says "connection to server on socket .* failed: "
start_postgres || fail "no server: $(cat why.txt)"
rows >after.txt
cmp before.txt after.txt || fail "something was written"
# The server refuses a drive.
sql fleet "CREATE OR REPLACE FUNCTION hold() RETURNS trigger LANGUAGE plpgsql AS \$\$BEGIN IF NEW.name = '3' THEN RAISE 'no room for it'; END IF; RETURN NEW; END\$\$"
catalogue 4 "$fleet"
says "no room for it \(drive 3\); nothing was changed$"
rows >after.txt
cmp before.txt after.txt || fail "something was written"
sql fleet "CREATE OR REPLACE FUNCTION hold() RETURNS trigger LANGUAGE plpgsql AS \$\$BEGIN RETURN NULL; END\$\$"
catalogue 4 "$fleet"
says "a rule or trigger of the database takes no row \(drive 1\); nothing was changed$"
sql fleet "DROP TRIGGER hold ON drives" "DROP FUNCTION hold"
catalogue 0 "$fleet"
same_as_geopackage drives/1 fleet.json

# Passwords: in the address, in the environment, in a file; a wrong one.
sql fleet "CREATE ROLE guarded LOGIN PASSWORD 'secret1/@'" "GRANT SELECT, INSERT, UPDATE ON drives, products TO guarded"
catalogue 4 "$(at guarded:secret1%2F%40 fleet)"
says "postgresql://guarded@/fleet\?host=.*: permission denied for table products; ask the owner "
sql fleet "GRANT DELETE ON products TO guarded"
catalogue 0 "$(at guarded:secret1%2F%40 fleet)"
says "^4 drives in postgresql://guarded@/fleet\?host=[^ ]*: 0 new, 4 replaced$"
catalogue 0 "$(at guarded fleet "password=secret1/%40")"
PGPASSWORD=secret1/@ catalogue 0 "$(at guarded fleet)"
echo "*:*:fleet:guarded:secret1/@" >pass.txt
chmod 600 pass.txt
PGPASSFILE=pass.txt catalogue 0 "$(at guarded fleet)"
catalogue 4 "$(at guarded:secret2 fleet)"
says 'password authentication failed for user "guarded"$'
catalogue 4 "$(at guarded fleet)"
says "no password supplied$"
catalogue 2 "$(at guarded:secret1/@ fleet)"
says "--out: no address of a database: .* a password's signs"
catalogue 2 "postgresql://guarded:secret1@x@host/fleet"
catalogue 2 "postgresql://guarded:secret1%zz@host/fleet"
says "invalid percent-encoded token"
catalogue 2 "postgresql://host/fleet?pasword=secret1"
catalogue 2 "mysql://boss:secret1@host/fleet"
says "--out: a catalogue is written to a file or to postgresql://"
ends 2 "$hueline" fleet catalogue fleet.json "$(at guarded:secret1 fleet)" --out x.gpkg
cat said.txt >>told.txt
says "given with --out$"
! grep secret told.txt || fail "a password was told"

# Servers that are not there, and users without rights.
catalogue 4 "postgresql://127.0.0.1:1/fleet"
says "postgresql://127.0.0.1:1/fleet: connection to server .* failed: Connection refused"
catalogue 4 "postgresql://nowhere.invalid/fleet"
says "could not translate host name"
sql fleet "CREATE ROLE guest LOGIN" "CREATE SCHEMA survey"
catalogue 4 "$(at guest fleet)"
says "permission denied for table drives; ask the owner "
catalogue 4 "$(at guest fleet "options=-csearch_path%3Dsurvey")"
says "there is no schema for the tables, or guest may not use it: the search path is survey; "
catalogue 4 "$(at boss fleet "options=-csearch_path%3Dsurvye")"
says "there is no schema for the tables, .* is survye; "
sql fleet "GRANT USAGE ON SCHEMA survey TO guest"
catalogue 4 "$(at guest fleet "options=-csearch_path%3Dsurvey")"
says "permission denied for schema survey; "

# A schema of its own, which need not have PostGIS in the search path; PostGIS in a schema of its own.
sql fleet "GRANT CREATE ON SCHEMA survey TO guest"
rows >before.txt
catalogue 0 "$(at guest fleet "options=-csearch_path%3Dsurvey")" better.json
says ": 2 new, 0 replaced$"
[ "$(sql fleet "SELECT count(*) FROM survey.drives WHERE line IS NOT NULL")" = 2 ] || fail "no rows in the schema"
rows >after.txt
cmp before.txt after.txt || fail "the wrong schema"
sql postgres "CREATE DATABASE other"
sql other 'CREATE SCHEMA "its Maps"' 'CREATE EXTENSION postgis SCHEMA "its Maps"'
for change in "2 new, 0 replaced" "0 new, 2 replaced"; do
  catalogue 0 "$(at boss other)" better.json
  says ": $change$"
done

# Tables that are none of the catalogue.
other() { sql fleet "DROP SCHEMA survey CASCADE" "CREATE SCHEMA survey" "$1"; catalogue 4 "$(at boss fleet "options=-csearch_path%3Dsurvey")"; says "$2"; }
other "CREATE TABLE survey.drives (id int, name text)" "the table survey.drives has no column line \(.*\): something else has made it, or another version of this program; rename it"
other "CREATE TABLE survey.products (drive_fid int)" "the table survey.products has the column drive_fid as integer instead of bigint: "
other "CREATE TABLE survey.drives (LIKE public.drives)" "the table survey.drives has no unique key \(key\): "
other "CREATE VIEW survey.drives AS SELECT * FROM public.drives" "the table survey.drives has no rows of its own \(a view\?\): "
[ "$(sql fleet "SELECT count(*) FROM pg_class WHERE relnamespace = 'survey'::regnamespace AND relname = 'products'")" = 0 ] || fail "half the tables"
! grep secret told.txt || fail "a password was told"
echo "four drives of two plans in a real database, with four writers at once and a server killed"
