// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0
// A pulse per second of the virtual machine (fetch_modules): what is written to /dev/hueline_pps, the time of an edge on CLOCK_REALTIME in
// ns as 8 bytes, comes out of /dev/ppsN as the stamp of an edge. The kernel's core of PPS does everything else.
#include <linux/fs.h>
#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/pps_kernel.h>
#include <linux/uaccess.h>

static struct pps_device *pps;

static ssize_t take_edge(struct file *file, const char __user *bytes, size_t size, loff_t *offset)
{
	struct pps_event_time stamp;
	s64 edge_ns;

	if (size != sizeof(edge_ns))
		return -EINVAL;
	if (copy_from_user(&edge_ns, bytes, sizeof(edge_ns)))
		return -EFAULT;
	pps_get_ts(&stamp);
	stamp.ts_real = ns_to_timespec64(edge_ns);
	pps_event(pps, &stamp, PPS_CAPTUREASSERT, NULL);
	return size;
}

static const struct file_operations operations = { .owner = THIS_MODULE, .write = take_edge };
static struct miscdevice device = { .minor = MISC_DYNAMIC_MINOR, .name = "hueline_pps", .fops = &operations };

static int __init begin(void)
{
	struct pps_source_info info = {
		.name = "hueline",
		.mode = PPS_CAPTUREASSERT | PPS_OFFSETASSERT | PPS_CANWAIT | PPS_TSFMT_TSPEC,
		.owner = THIS_MODULE,
	};
	int error;

	pps = pps_register_source(&info, PPS_CAPTUREASSERT);
	if (IS_ERR(pps))
		return PTR_ERR(pps);
	error = misc_register(&device);
	if (error)
		pps_unregister_source(pps);
	return error;
}

static void __exit end(void)
{
	misc_deregister(&device);
	pps_unregister_source(pps);
}

module_init(begin);
module_exit(end);
MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("A pulse per second whose edges a test places");
