#!/usr/bin/env bash
# Recordings at s3:// are read as files are, from a server that checks signatures: the same bytes come out, a part fetches a part, and what is
# wrong, slow, broken or away is told. server.mjs has the server and the gate before it.
# usage: server_test.sh HUELINE IMAGE_PROOF SOURCE_DIR SERVER_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3 server=$4
command -v node >/dev/null || { echo "SKIPPED: node is not installed"; exit 77; }
work=$(mktemp -d)
pid=""
trap '[ -z "$pid" ] || kill "$pid" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"

# Nothing of the user's own.
export HOME=$work AWS_EC2_METADATA_DISABLED=true
unset AWS_PROFILE AWS_REGION AWS_DEFAULT_REGION AWS_SESSION_TOKEN AWS_ENDPOINT_URL_S3 AWS_CA_BUNDLE http_proxy all_proxy || true
mkdir -p storage
port=0
start() {  # the first time at a port that is free, later at the same
  : >server.txt
  node "$server/server.mjs" "$work/storage" "$port" >server.txt 2>&1 & pid=$!
  for ((i = 0; i < 200; i++)); do
    if grep -q '^listening on ' server.txt; then
      port=$(sed -n 's/^listening on //p' server.txt)
      return 0
    fi
    kill -0 $pid 2>/dev/null || break
    sleep 0.05
  done
  fail "the server does not start: $(cat server.txt)"
}
start
export AWS_ENDPOINT_URL=http://127.0.0.1:$port AWS_ACCESS_KEY_ID=S3RVER AWS_SECRET_ACCESS_KEY=S3RVER
order() { printf '%s' "$1" >storage/gate.json; }
upload() {  # FILE KEY
  curl --silent --show-error --fail --aws-sigv4 aws:amz:us-east-1:s3 --user S3RVER:S3RVER -H "x-amz-content-sha256: UNSIGNED-PAYLOAD" \
    --upload-file "$1" "$AWS_ENDPOINT_URL/drives/$2" || fail "upload of $2"
}
# same_packets A B WHAT: two recordings have the same packets; where they are from is in their headers
same_packets() {
  PYTHONPATH=$source/tests/support python3 -c 'import pathlib, sys; from recorded_messages import messages
one, other = (messages(pathlib.Path(name)) for name in sys.argv[1:3])
sys.exit(not one or one != other)' "$1" "$2" || fail "$3"
}
fetched() { awk '{ bytes += $4 } END { print bytes + 0 }' storage/gate.log; }

cat >scenario.yaml <<END
seed: 3
duration_s: 12
street: {furnished: false}
drive: {stand_s: 0, accelerate_s: 0.5, speed: 6}
camera: {rate_hz: 4, lens_width: 204, lens_height: 172}
END
mkdir -p "local/drive 1"
"$proof" scenario.yaml sim "local/drive 1" >said.txt 2>&1 || fail "the drive"
size=$(stat -c %s "local/drive 1/drive.mcap")
upload "local/drive 1/drive.mcap" "2026/drive%201/drive.mcap"
at="s3://drives/2026/drive 1"

# What is read is what the file has; a folder stands for its drive.mcap.
ends 0 "$hueline" inspect "local/drive 1/drive.mcap" --json
grep -v '^[0-9:]* info' said.txt >file.json
: >storage/gate.log
ends 0 "$hueline" inspect "$at/drive.mcap" --json
says "info object storage: [0-9.]+ MB fetched, 0.0 MB sent, [0-9]+ requests$"
grep -v '^[0-9:]* info' said.txt | sed "s|$at|local/drive 1|" >address.json
cmp file.json address.json || fail "inspect differs: $(diff file.json address.json)"
[ "$(fetched)" -lt $((size + 2500000)) ] || fail "$(fetched) bytes were fetched of $size"
ends 0 "$hueline" verify "$at"
ends 0 "$hueline" replay "local/drive 1" --out file --no-feed
ends 0 "$hueline" replay "$at" --out address --no-feed
(cd file && sha256sum -- *) >file.txt
(cd address && sha256sum -- *) >address.txt
cmp file.txt address.txt || fail "a replay from the storage gives other bytes: $(diff file.txt address.txt)"

# A part: what lies before and behind it is not fetched.
ends 0 "$hueline" cut "local/drive 1" --from 5 --to 6 --out file.mcap
: >storage/gate.log
ends 0 "$hueline" cut "$at" --from 5 --to 6 --out address.mcap
echo "a cut of one second of 12: $(fetched) of $size bytes"
[ "$(fetched)" -lt $((size * 45 / 100)) ] || fail "a part fetches $(fetched) of $size bytes"
same_packets file.mcap address.mcap "a part from the storage has other packets"
# Without an index it is read through, which is told.
head -c $((size - 1)) "local/drive 1/drive.mcap" >cut.mcap
upload cut.mcap cut/drive.mcap
ends 0 "$hueline" cut s3://drives/cut --from 5 --to 6 --out again.mcap
says "warning s3://drives/cut/drive.mcap has no index"
same_packets file.mcap again.mcap "a part from a recording without an index has other packets"

# Clouds, too.
upload file/cloud.las clouds/cloud.las
ends 0 "$hueline" export s3://drives/clouds --profile laz --out address.laz
ends 0 "$hueline" export file/cloud.las --profile laz --out file.laz
cmp file.laz address.laz || fail "an export from the storage gives other bytes"

# Fleets: the plan has addresses.
ends 0 "$hueline" fleet plan "$at/" --out fleet.json
grep -q "\"file\": \"$at/drive.mcap\"" fleet.json || fail "the plan: $(cat fleet.json)"
ends 0 "$hueline" fleet run fleet.json
(cd "fleet/drive 1" && sha256sum -- $(ls | grep -v -e '^result.json$' -e '^log.txt$')) >address.txt
cmp file.txt address.txt || fail "a fleet from the storage gives other bytes: $(diff file.txt address.txt)"

# Its results go into the storage, once.
ends 0 "$hueline" fleet upload fleet.json s3://drives/results
says "^1 of 1 drives are at s3://drives/results$"
for product in cloud.las result.json log.txt; do
  curl --silent --fail --aws-sigv4 aws:amz:us-east-1:s3 --user S3RVER:S3RVER -H "x-amz-content-sha256: UNSIGNED-PAYLOAD" -o got "$AWS_ENDPOINT_URL/drives/results/drive%201/$product"
  cmp got "fleet/drive 1/$product" || fail "$product is another one in the storage"
done
ends 0 "$hueline" fleet upload fleet.json s3://drives/results
says "0.0 MB sent"
# A file of more than 64 MB goes in parts. It counts as a result if result.json says so.
head -c 150000000 /dev/zero >"fleet/drive 1/large.bin"
printf 'end' >>"fleet/drive 1/large.bin"
python3 - "fleet/drive 1" <<'END'
import hashlib, json, sys
folder = sys.argv[1]
result = json.load(open(folder + "/result.json"))
large = open(folder + "/large.bin", "rb").read()
result["products"]["large.bin"] = {"bytes": len(large), "sha256": hashlib.sha256(large).hexdigest()}
json.dump(result, open(folder + "/result.json", "w"))
END
ends 0 "$hueline" fleet upload fleet.json s3://drives/results
says "150.0 MB sent"
cmp "storage/drives/results/drive 1/large.bin._S3rver_object" "fleet/drive 1/large.bin" || fail "the large file is another one in the storage"
ends 4 "$hueline" fleet upload fleet.json s3://nobody/results
says "there is no bucket nobody .*; the results of drive 1 stay in $work/fleet/drive 1$"
ends 2 "$hueline" fleet upload fleet.json results

# Wrong names, keys and places.
ends 3 "$hueline" inspect s3://drives/nothing.mcap
says "error s3://drives/nothing.mcap: there is no such object \(404 NoSuchKey\)$"
ends 3 "$hueline" inspect s3://nobody/drive.mcap
says "error s3://nobody/drive.mcap: there is no bucket nobody at http://127.0.0.1:$port \(404 NoSuchBucket\)$"
AWS_SECRET_ACCESS_KEY=wrong ends 3 "$hueline" verify "$at"
says "the secret does not belong to the access key S3RVER: check AWS_ACCESS_KEY_ID \(403 SignatureDoesNotMatch\)$"
AWS_ACCESS_KEY_ID=NOBODY ends 3 "$hueline" verify "$at/drive.mcap"
says "the storage does not know the access key NOBODY: .* \(403 InvalidAccessKeyId\)$"
AWS_ENDPOINT_URL=http://127.0.0.1:9 ends 3 "$hueline" verify "$at/drive.mcap"
says "tried [0-9]+ times: check the network, AWS_ENDPOINT_URL and AWS_REGION$"
order '{"region": "eu-west-1"}'
ends 3 "$hueline" verify "$at/drive.mcap"
says "the bucket is in the region eu-west-1: set AWS_REGION=eu-west-1 \(301\)$"
rm storage/gate.json
mkdir .aws
printf '[survey]\naws_access_key_id = S3RVER\naws_secret_access_key = S3RVER\n' >.aws/credentials
env -u AWS_ACCESS_KEY_ID -u AWS_SECRET_ACCESS_KEY AWS_PROFILE=survey "$hueline" verify "$at" >said.txt 2>&1 || fail "a profile"
AWS_PROFILE=nobody ends 2 "$hueline" verify "$at"
says "AWS_PROFILE is \"nobody\""
! grep -rq wrong said.txt || fail "a secret was told"
# Results stay here.
ends 4 "$hueline" cut "$at" --out s3://drives/part.mcap
says "results are not written to object storage"
ends 4 "$hueline" replay "$at" --out s3://drives/again --no-feed
says "results are not written to object storage"
[ ! -e s3: ] || fail "a folder named s3:"

# A server that is busy, that ends its answers early, and that is slow.
order '{"fail": 2, "cut": 2, "slow_ms": 15}'
ends 0 "$hueline" cut "$at" --out again.mcap
says "warning $at/drive.mcap: .*; it is tried again$"
says "info object storage: .* requests, [2-9] of them tried again$"
same_packets "local/drive 1/drive.mcap" again.mcap "a bad connection gives other packets"

# A server that is away for a while.
order '{"slow_ms": 120}'
: >storage/gate.log
"$hueline" cut "$at" --out away.mcap >away.txt 2>&1 & cut=$!
for ((i = 0; i < 200; i++)); do [ "$(fetched)" -lt 4000000 ] || break; sleep 0.05; done
kill $pid; wait $pid 2>/dev/null || true
kill -0 $cut 2>/dev/null || fail "the server was killed too late: $(cat away.txt)"
sleep 1
start
wait $cut || fail "a server that was away: $(cat away.txt)"
same_packets "local/drive 1/drive.mcap" away.mcap "a server that was away gives other packets"
grep -q "tried again" away.txt || fail "nothing is told: $(cat away.txt)"

# An object that is replaced while it is read is no mixture of both.
: >storage/gate.log
"$hueline" cut "$at" --out mixture.mcap >away.txt 2>&1 & cut=$!
for ((i = 0; i < 200; i++)); do [ "$(fetched)" -lt 4000000 ] || break; sleep 0.05; done
{ head -c $((size - 8)) "local/drive 1/drive.mcap"; printf 'replaced'; } >other.mcap
upload other.mcap "2026/drive%201/drive.mcap"
status=0
wait $cut || status=$?
[ $status = 3 ] || fail "a replaced object gives $status: $(cat away.txt)"
grep -q "the object was replaced while it was read: begin again" away.txt || fail "not told: $(cat away.txt)"
echo "object storage: passed"
