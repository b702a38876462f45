# To be sourced by tests that need a database: a PostgreSQL server of its own in the folder $server, on a socket in that folder and on no
# port. The computer's own servers, if there are any, stay as they are.
postgres_programs=/usr/lib/postgresql/15/bin
# has_postgres: fails if server or PostGIS is not installed
has_postgres() { [ -x $postgres_programs/postgres ] && [ -e /usr/share/postgresql/15/extension/postgis.control ] && command -v psql >/dev/null; }
# as_postgres COMMAND...: as the user whom the package makes if this is root, for whom the server does not start
as_postgres() {
  if [ "$(id -u)" = 0 ]; then runuser -u postgres -- "$@"; else "$@"; fi
}
# start_postgres, again after stop_postgres: fails, with the reason in why.txt
start_postgres() {
  if [ ! -e "$server/data" ]; then
    mkdir -p "$server"
    [ "$(id -u)" != 0 ] || chown postgres "$server"
    as_postgres $postgres_programs/initdb -D "$server/data" -U boss --no-sync --no-instructions -E UTF8 --locale=C.UTF-8 -A trust >why.txt 2>&1 || return 1
    # Who is called guarded must give a password.
    printf 'local all guarded scram-sha-256\nlocal all all trust\n' | as_postgres tee "$server/data/pg_hba.conf" >/dev/null
    printf "%s\n" "listen_addresses = ''" "unix_socket_directories = '$server'" "fsync = off" "shared_buffers = 16MB" |
      as_postgres tee -a "$server/data/postgresql.conf" >/dev/null
  fi
  as_postgres $postgres_programs/pg_ctl -D "$server/data" -l "$server/log.txt" -w -t 60 start >why.txt 2>&1 || { cat "$server/log.txt" >>why.txt; return 1; }
}
# stop_postgres [MODE]: at once as by a cut of power, unless MODE says otherwise
stop_postgres() { [ ! -e "$server/data/postmaster.pid" ] || as_postgres $postgres_programs/pg_ctl -D "$server/data" -m "${1:-immediate}" -w stop >/dev/null 2>&1; }
# sql DATABASE STATEMENT...: what the statements answer, one row a line
sql() {
  local database=$1 one; shift
  for one; do PGOPTIONS='-c client_min_messages=warning' psql -XAtq -v ON_ERROR_STOP=1 -h "$server" -U boss -d "$database" -c "$one" || return 1; done
}
