#!/usr/bin/env bash
# Runs README's two commands on a Debian that has only python3 and git, in a folder, and asks `cqos modeler` for its page.
#
#   sudo tests/bare_machine.sh RELEASE FOLDER [COMMAND...]      RELEASE: bookworm (Debian 12) or trixie (Debian 13)
#
# FOLDER is created by debootstrap; what stands in it already is used again, so name a new one for a fresh machine. The commit that
# is checked out here is cloned into it. COMMAND, a line for the shell in that clone, replaces the two commands.
set -euo pipefail
release=$1 folder=$2
shift 2
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

if [ ! -e "$folder/usr/bin/git" ]; then
  debootstrap --variant=minbase --include=python3,git,ca-certificates "$release" "$folder" >"$folder.log" 2>&1 ||
    { tail -n 5 "$folder.log" >&2; exit 1; }
fi
folder=$(cd "$folder" && pwd)

# The way to package indexes is that of this machine: name servers, certificates, proxies.
cp /etc/resolv.conf "$folder/etc/resolv.conf"
certificates=${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}
cp "$certificates" "$folder/etc/ssl/certs/ca-certificates.crt"
[ ! -f /etc/hosts ] || cp /etc/hosts "$folder/etc/hosts"
known=/etc/ssl/certs/ca-certificates.crt
passed=(CI=true HOME=/home TERM=dumb LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
  "SSL_CERT_FILE=$known" "PIP_CERT=$known" "NODE_EXTRA_CA_CERTS=$known" "NPM_CONFIG_CAFILE=$known")
for name in http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY PIP_INDEX_URL NPM_CONFIG_REGISTRY; do
  [ -z "${!name:-}" ] || passed+=("$name=${!name}")
done

mounted=()
leave() {
  for ((at = ${#mounted[@]} - 1; at >= 0; at--)); do umount -l "$folder/${mounted[$at]}"; done
}
trap leave EXIT
for each in proc dev dev/pts; do
  case $each in
    proc) mount -t proc proc "$folder/proc" ;;
    *) mount --bind "/$each" "$folder/$each" ;;
  esac
  mounted+=("$each")
done

rm -rf "$folder/home/cqos"
git clone -q "$source" "$folder/home/cqos"

inside() { chroot "$folder" /usr/bin/env -i "${passed[@]}" bash -c "cd /home/cqos && $1"; }

if [ $# -gt 0 ]; then
  inside "$*"
  exit
fi
began=$SECONDS
inside "python3 dev.py demo"
echo "bare machine ($release): the demo took $((SECONDS - began)) s"
began=$SECONDS
inside "python3 dev.py test"
echo "bare machine ($release): the tests took $((SECONDS - began)) s"
inside '
  .venv/bin/cqos modeler --no-browser >/tmp/modeler.txt &
  for _ in $(seq 300); do grep -q http /tmp/modeler.txt && break; sleep 0.1; done
  address=$(grep -o "http://[^#]*" /tmp/modeler.txt)
  python3 -c "import sys, urllib.request; page = urllib.request.urlopen(sys.argv[1]).read(); assert b\"<title>\" in page" "$address"
  kill -TERM $!; wait $! || [ $? -eq 143 ]'
echo "bare machine ($release): cqos modeler serves its page"
