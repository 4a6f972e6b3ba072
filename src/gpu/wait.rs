//! Waiting for the device: a driver is waited for, a browser calls back.
//!
//! What waits is written once, as a future. On native targets it never suspends, since each wait blocks; in a browser it
//! suspends until the event loop has the answer.

use super::GpuError;
use super::adapter::Gpu;

/// Runs a future of this crate to its end.
#[cfg(not(target_family = "wasm"))]
pub fn wait_for<T>(future: impl Future<Output = T>) -> T {
    pollster::block_on(future)
}

/// Runs a future that needs no answer of the device to its end.
///
/// # Panics
/// It does need one: a browser answers only after control has returned to it, so its callers must await.
#[cfg(target_family = "wasm")]
pub fn wait_for<T>(future: impl Future<Output = T>) -> T {
    use std::task::{Context, Poll, Waker};
    match std::pin::pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("in a browser the device must be awaited"),
    }
}

impl Gpu {
    /// Waits for all submitted work, and maps `buffers` for reading.
    ///
    /// # Errors
    /// The device is lost or does not finish in time.
    #[cfg(not(target_family = "wasm"))]
    pub(super) async fn finished(&self, buffers: &[&wgpu::Buffer]) -> Result<(), GpuError> {
        for buffer in buffers {
            buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        }
        self.wait()
    }

    /// Waits for all submitted work, and maps `buffers` for reading.
    ///
    /// # Errors
    /// The device is lost.
    #[cfg(target_family = "wasm")]
    pub(super) async fn finished(&self, buffers: &[&wgpu::Buffer]) -> Result<(), GpuError> {
        let events = events::Events::default();
        for buffer in buffers {
            let done = events.expect();
            buffer.map_async(wgpu::MapMode::Read, .., move |_| done());
        }
        let done = events.expect();
        self.queue.on_submitted_work_done(done);
        events.await;
        match self.lost() {
            Some(cause) => Err(GpuError::Lost(cause)),
            None => Ok(()),
        }
    }
}

#[cfg(target_family = "wasm")]
mod events {
    use std::pin::Pin;
    use std::sync::{Arc, Mutex, PoisonError};
    use std::task::{Context, Poll, Waker};

    /// Callbacks that have not come yet, and whom the last one wakes.
    #[derive(Default)]
    pub(super) struct Events(Arc<Mutex<(usize, Option<Waker>)>>);

    impl Events {
        /// One more callback to wait for.
        pub(super) fn expect(&self) -> impl FnOnce() + Send + use<> {
            let state = Arc::clone(&self.0);
            lock(&state).0 += 1;
            move || {
                let mut state = lock(&state);
                state.0 -= 1;
                // Earlier callbacks leave the waker to the last.
                if state.0 == 0
                    && let Some(waker) = state.1.take()
                {
                    waker.wake();
                }
            }
        }
    }

    impl Future for Events {
        type Output = ();

        fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
            let mut state = lock(&self.0);
            if state.0 == 0 {
                return Poll::Ready(());
            }
            state.1 = Some(context.waker().clone());
            Poll::Pending
        }
    }

    fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
        mutex.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
