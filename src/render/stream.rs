//! Many pictures from threads that never wait for each other, shown in their order, with bounded memory.
//!
//! A thread that is done with a picture takes up the next one. If the picture that is to be shown next is ready it shows that
//! one before, and all that follow it and are ready too. The others go on meanwhile, until as many pictures are rendered and not
//! shown as memory is meant for. So a caller who is quick keeps no thread from its work, and one who is slow is shown many
//! pictures at a time, which he may share among threads in turn. Buffers whose pictures were shown are taken up again, the last
//! one first, while it is near the processor.
//!
//! Each picture is a task of the pool, so that a thread that waits for others within one, or within the caller's work, may take
//! up another picture on top of it. It never comes to show pictures within showing some. Pictures that are painted by one
//! thread each add one level; those that threads share, no more levels than there are pictures in memory.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::Scope;

use super::View;
use super::batch::group_length;
use crate::error::Result;
use crate::panorama::Panorama;

/// Whom pictures are shown to, with the number of the first of them.
type Sink<'a> = dyn FnMut(usize, &mut [Panorama]) -> Result<()> + Send + 'a;

/// Renders views with `paint`, which is told whether to share the picture among threads, and shows them to `sink`.
///
/// # Errors
/// That of the first picture that fails, when all before it have been shown, or of `sink`.
pub(super) fn run<'a, P>(views: &'a [View<'a>], paint: P, sink: &'a mut Sink<'a>) -> Result<()>
where
    P: Fn(&View<'_>, &mut Panorama, bool) -> Result<()> + Sync,
{
    let threads = rayon::current_num_threads();
    let pixels = views.iter().map(|v| v.projection.pixels()).max().unwrap_or(0);
    let most_shown = group_length(pixels, threads);
    let tickets = views.len().min(2 * most_shown);
    let line = Line { views, paint, threads, most_shown, state: Mutex::new(State::new(tickets, sink)) };
    rayon::scope(|scope| (0..tickets).for_each(|_| scope.spawn(|scope| line.take(scope))));
    let state = line.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.ended.map_or(Ok(()), Err)
}

/// Pictures on their way.
struct Line<'a, P> {
    views: &'a [View<'a>],
    paint: P,
    threads: usize,
    /// Most pictures to show at once; there are twice as many in memory at most.
    most_shown: usize,
    state: Mutex<State<'a>>,
}

struct State<'a> {
    /// Pictures that threads were asked for.
    tickets: usize,
    /// Pictures that threads have begun.
    begun: usize,
    /// Pictures that were shown or are being shown.
    shown: usize,
    /// Those that follow them; `None` where not done yet.
    ready: VecDeque<Option<Result<Panorama>>>,
    /// Buffers to take up again.
    spare: Vec<Panorama>,
    /// `None` while a thread is showing.
    sink: Option<&'a mut Sink<'a>>,
    /// What ended it early.
    ended: Option<crate::Error>,
}

/// Pictures to show, with the number of the first of them.
struct Turn<'a> {
    sink: &'a mut Sink<'a>,
    first: usize,
    pictures: Vec<Panorama>,
}

impl<'a, P> Line<'a, P>
where
    P: Fn(&View<'_>, &mut Panorama, bool) -> Result<()> + Sync,
{
    /// Takes up the next picture, and shows what is ready then.
    fn take<'s>(&'s self, scope: &Scope<'s>) {
        let Some((number, mut picture)) = self.state().begin() else { return };
        // Where threads would be left without a picture they share those there are.
        let share = self.most_shown.min(self.views.len() - number) < self.threads;
        let painted = (self.paint)(&self.views[number], &mut picture, share).map(|()| picture);
        self.state().put(number, painted);
        loop {
            let Some(mut turn) = self.state().turn(self.most_shown) else { return };
            let told = (turn.sink)(turn.first, &mut turn.pictures);
            let more = self.state().end(turn, told, self.views.len());
            (0..more).for_each(|_| scope.spawn(|scope| self.take(scope)));
        }
    }

    fn state(&self) -> MutexGuard<'_, State<'a>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<'a> State<'a> {
    fn new(tickets: usize, sink: &'a mut Sink<'a>) -> Self {
        let (ready, spare) = (VecDeque::new(), Vec::new());
        Self { tickets, begun: 0, shown: 0, ready, spare, sink: Some(sink), ended: None }
    }

    /// Number of the next picture, and a buffer for it; `None` where it has ended early.
    fn begin(&mut self) -> Option<(usize, Panorama)> {
        if self.ended.is_some() {
            return None;
        }
        self.begun += 1;
        Some((self.begun - 1, self.spare.pop().unwrap_or_else(Panorama::empty)))
    }

    /// Keeps a picture until its turn.
    fn put(&mut self, number: usize, picture: Result<Panorama>) {
        let place = number - self.shown;
        if self.ready.len() <= place {
            self.ready.resize_with(place + 1, || None);
        }
        self.ready[place] = Some(picture);
    }

    /// What to show now, `most` pictures at most; `None` where there is nothing, or another thread is at it.
    fn turn(&mut self, most: usize) -> Option<Turn<'a>> {
        if self.ended.is_some() || self.sink.is_none() {
            return None;
        }
        let ready = self.ready.iter().take(most).take_while(|picture| matches!(picture, Some(Ok(_)))).count();
        if ready == 0 {
            let failed = self.ready.pop_front_if(|picture| matches!(picture, Some(Err(_))));
            self.ended = failed.flatten().and_then(Result::err);
            return None;
        }
        let first = self.shown;
        self.shown += ready;
        let pictures = self.ready.drain(..ready).filter_map(|picture| picture?.ok()).collect();
        self.sink.take().map(|sink| Turn { sink, first, pictures })
    }

    /// Takes back what was shown, of `all` pictures; the number of pictures to ask threads for now.
    fn end(&mut self, turn: Turn<'a>, told: Result<()>, all: usize) -> usize {
        self.sink = Some(turn.sink);
        self.ended = told.err();
        if self.ended.is_some() {
            return 0;
        }
        let more = turn.pictures.len().min(all - self.tickets);
        self.spare.extend(turn.pictures);
        self.tickets += more;
        more
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    use super::*;
    use crate::Error;
    use crate::geometry::Pose;
    use crate::panorama::Projection;

    const THREADS: usize = 3;

    /// Views whose x is their number, of which at most one a thread is shown at once.
    fn views(count: usize) -> Vec<View<'static>> {
        let projection = Projection::new(2048, 256);
        (0..count).map(|k| View { projection, robot: Pose::new(k as f64, 0.0, 0.0), bodies: &[] }).collect()
    }

    /// Paints only the number of a view.
    fn number(view: &View<'_>, out: &mut Panorama) -> usize {
        out.range_m = vec![view.robot.x as f32];
        view.robot.x as usize
    }

    fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(THREADS).build().unwrap().install(work)
    }

    /// Waits until so many are counted; fails when they never are.
    fn wait_for(count: &AtomicUsize, enough: usize) {
        let began = Instant::now();
        while count.load(Ordering::SeqCst) < enough {
            assert!(began.elapsed() < Duration::from_secs(20), "{} of {enough}", count.load(Ordering::SeqCst));
            std::thread::yield_now();
        }
    }

    #[test]
    fn no_thread_waits_for_another_and_all_is_shown_in_order() {
        let painted = AtomicUsize::new(0);
        let mut shown = Vec::new();
        let paint = |view: &View<'_>, out: &mut Panorama, _: bool| {
            // The first is done last of all that may be in memory at once.
            if number(view, out) == 0 {
                wait_for(&painted, 2 * THREADS - 1);
            }
            painted.fetch_add(1, Ordering::SeqCst);
            Ok(())
        };
        in_pool(|| {
            run(&views(50), paint, &mut |first, pictures| {
                // Twice as many as may be shown at once, those that are being shown among them.
                assert!(painted.load(Ordering::SeqCst) <= first + 2 * THREADS);
                assert_eq!(first, shown.len());
                shown.extend(pictures.iter().map(|p| p.range_m[0] as usize));
                Ok(())
            })
        })
        .unwrap();
        assert_eq!(shown, (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn one_who_was_slow_is_shown_all_that_are_ready() {
        let mut sink = |_: usize, _: &mut [Panorama]| Ok(());
        let mut state = State::new(6, &mut sink);
        let begun: Vec<_> = (0..6).map(|_| state.begin().unwrap()).collect();
        let order = [1, 0, 4, 5, 2, 3];
        let mut turns = Vec::new();
        let mut under_way = None;
        for number in order {
            state.put(number, Ok(begun[number].1.clone()));
            // From when 0 is ready the caller works on 0 and 1 until the last is done.
            under_way = under_way.or_else(|| state.turn(3));
            assert!(under_way.is_none() || state.turn(3).is_none(), "one thread at a time");
        }
        while let Some(turn) = under_way {
            let (first, count) = (turn.first, turn.pictures.len());
            turns.push((first, count, state.end(turn, Ok(()), 9)));
            under_way = state.turn(3);
        }
        // First, how many, and how many are asked for in their place; of nine there are three left.
        assert_eq!(turns, [(0, 2, 2), (2, 3, 1), (5, 1, 0)]);
    }

    #[test]
    fn the_first_failure_in_order_is_told_when_all_before_it_are_shown() {
        let failed = AtomicUsize::new(0);
        let mut shown = 0;
        let paint = |view: &View<'_>, out: &mut Panorama, _: bool| match number(view, out) {
            8 => {
                wait_for(&failed, 1);
                Err(Error::Threads("8".into()))
            }
            9 => {
                failed.fetch_add(1, Ordering::SeqCst);
                Err(Error::Threads("9".into()))
            }
            _ => Ok(()),
        };
        let result = in_pool(|| {
            run(&views(50), paint, &mut |_, pictures| {
                shown += pictures.len();
                Ok(())
            })
        });
        assert!(matches!(result, Err(Error::Threads(which)) if which == "8"));
        assert_eq!(shown, 8);
    }
}
