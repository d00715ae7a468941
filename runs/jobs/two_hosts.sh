#!/usr/bin/env bash
# Two hosts on one machine: runs a command under MPI with RANKS ranks (default 1) on each of two
# network namespaces, which see each other only by a virtual cable, with names and daemons of their
# own, so that everything passes through TCP as between two machines. Needs root and `ip`.
#   RANKS=1 bash runs/jobs/two_hosts.sh python -m solver SCENE -o OUT
# On real machines: mpirun --host a:16,b:16 python -m solver SCENE -o OUT, with the checkout and OUT
# on a disk that both see, and ssh between them without a password.
set -euo pipefail
[ "$(id -u)" -eq 0 ] || { echo "two_hosts.sh: needs root, to make network namespaces" >&2; exit 2; }
command -v ip >/dev/null || { echo "two_hosts.sh: needs ip; fix: apt-get install iproute2" >&2; exit 2; }

tag=bt$$
net=10.77.$((RANDOM % 250 + 1))
agent=$(mktemp)
cleanup() {
    code=$?
    for host in 1 2; do
        ip netns pids "$tag-$host" 2>/dev/null | xargs -r kill -9 2>/dev/null || true
        ip netns del "$tag-$host" 2>/dev/null || true
    done
    rm -f "$agent"
    exit $code
}
trap cleanup EXIT
trap 'exit 143' TERM INT

for host in 1 2; do ip netns add "$tag-$host"; done
ip link add "$tag.1" netns "$tag-1" type veth peer name "$tag.2" netns "$tag-2"
for host in 1 2; do
    ip -n "$tag-$host" link set lo up
    ip -n "$tag-$host" address add "$net.$host/24" dev "$tag.$host"
    ip -n "$tag-$host" link set "$tag.$host" up
done

# What mpirun takes for ssh: agent ADDRESS COMMAND...
cat >"$agent" <<AGENT
#!/usr/bin/env bash
host=\${1##*.}
shift
exec ip netns exec "$tag-\$host" unshare --uts bash -c "hostname $tag-\$host; \$*"
AGENT
chmod +x "$agent"

export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
ip netns exec "$tag-1" unshare --uts bash -c 'hostname "$0"; exec "$@"' "$tag-1" \
    mpirun --host "$net.1:${RANKS:-1},$net.2:${RANKS:-1}" -n "$((2 * ${RANKS:-1}))" \
    --mca plm_rsh_agent "$agent" --mca btl tcp,self --mca btl_tcp_if_include "$net.0/24" \
    --mca oob_tcp_if_include "$net.0/24" --mca mpi_yield_when_idle 1 "$@" </dev/null
