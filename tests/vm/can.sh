# In the guest: CAN interfaces of three kinds. vx0 <-> vx1: a cable between two; vcan0: one that hears itself; an adapter on a serial
# line (slcan), whose line and wire the test program plays.
set -e
modprobe vcan
modprobe vxcan
modprobe slcan
modprobe can-raw
ip link add vcan0 type vcan
ip link set vcan0 up
ip link add vx0 type vxcan peer name vx1
for name in vx0 vx1; do
  ip link set $name mtu 72
  ip link set $name up
done
"$HUELINE_BIN/vm_can_test"
