//! How much memory a read takes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes that are allocated, and the most that were since [`Peak::start`].
static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// A single request beyond this ends the test: it would bring the machine down before any count.
const ENOUGH: usize = 8 << 30;

/// Where the file that is being read lies; for the last words.
pub static PLACE: OnceLock<String> = OnceLock::new();

/// The system's allocator, counting.
pub struct CountingAllocator;

fn more(bytes: usize) {
    if bytes > ENOUGH {
        last_words(&format_args!("a reader asked for {bytes} bytes at once"));
    }
    let now = NOW.fetch_add(bytes, Relaxed) + bytes;
    PEAK.fetch_max(now, Relaxed);
}

/// Ends the process with a message that the test harness does not hold back.
pub fn last_words(what: &dyn std::fmt::Display) -> ! {
    use std::io::Write;
    let place = PLACE.get().map_or("", String::as_str);
    let _ = writeln!(
        std::io::stderr(),
        "FINDING: {what}; the file lies in {place}"
    );
    std::process::abort()
}

// SAFETY: every request goes to the system's allocator as it is.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both may exist while the bytes are moved.
        more(size);
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// The most memory that is taken from now on.
pub struct Peak(usize);

impl Peak {
    pub fn start() -> Self {
        let now = NOW.load(Relaxed);
        PEAK.store(now, Relaxed);
        Self(now)
    }

    pub fn bytes(&self) -> usize {
        PEAK.load(Relaxed).saturating_sub(self.0)
    }
}
