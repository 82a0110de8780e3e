/* One publisher, one broker, one subscriber and one fault, as MQTT 3.1.1 and 5.0 describe them. Times are in milliseconds.
 *
 * The publisher sends ALL messages, numbered from 1. Sets of messages are bits of a byte. The fault happens at any time. Every
 * run ends, so `<>[]` is about the end of each run. Lines that start with @ are the steps that C-QoS shows.
 */

#ifndef ALL
#define ALL 2
#endif
#define SLOTS 10
#define BIT(n) (1 << (n))
#define HAS(n, state) (publisher_has[n] == state)
#define UNACKNOWLEDGED \
  (HAS(1, SENT) + HAS(2, SENT) + HAS(3, SENT) + HAS(1, RECEIVED) + HAS(2, RECEIVED) + HAS(3, RECEIVED))
#define NEXT (HAS(1, WAITS) -> 1 : (HAS(2, WAITS) -> 2 : 3))
#define IS_KEPT (subscriber_link || DELIVERED_QOS > 0 || QUEUES_QOS0)
#define IS_FULL (waiting >= ROOM && (!subscriber_link || FAULT == SLOW_READER))
#define CAN_SEND (publisher_up && (HAS(1, WAITS) || HAS(2, WAITS) || HAS(3, WAITS)) && UNACKNOWLEDGED < SENDS_AT_ONCE)

mtype = { PUBLISH, PUBACK, PUBREC, PUBREL, PUBCOMP, WILL, FREE, WAITS, SENT, RECEIVED };

/* The wires. A packet to the broker has the number of its message, one from the broker also that of its slot. */
chan up = [6] of { mtype, byte };
chan up_answers = [6] of { mtype, byte };
chan down = [SLOTS] of { mtype, byte, byte };
chan down_answers = [SLOTS] of { mtype, byte };
bool broker_runs = true;
bool link_works = true;

/* The publisher: `publisher_up` is what it believes of its connection, `publisher_link` what the broker does. */
bool publisher_runs = true;
bool publisher_up;
bool publisher_link;
bool sent_again;
byte published;
mtype publisher_has[4] = FREE;

/* The broker: the session of the publisher, the session of the subscriber with its queue, and the retained message. */
bool publisher_session;
bool passes_on_late;              /* QoS 2: at PUBREL, not at PUBLISH; both are allowed */
byte known;                       /* QoS 2: from the publisher, and not released yet */
bool subscriber_session;
bool subscribed;
bool subscriber_link;
byte message_in[SLOTS];           /* in order; a slot is a packet identifier, and no slot is used twice */
mtype slot_is[SLOTS] = FREE;
byte next_slot;
byte waiting;
byte on_their_way;
byte retained;
byte taken;                       /* the newest that the broker ever passed on */

/* The subscriber. */
bool subscriber_runs = true;
bool must_subscribe = true;       /* a library whose session goes on need not subscribe again, a new program does */
bool joined;
bool slow = (FAULT == SLOW_READER);
short seen;                       /* QoS 2: slots that the program has, and that are not released yet */

/* What the formulas are about. `newest` is the newest that the program of now has got. */
byte due;
byte newest_due;
byte got;
byte twice;
byte newest;
byte had_to_get;
byte passed_on_while_away;
byte old;
bool overtaken;
bool too_old;
bool gap_too_long;
bool publisher_lost;
int loss_noticed_after = ENDLESS;

/* What the broker saved before it crashes. */
bool saved;
bool saved_publisher_session;
bool saved_subscriber_session;
bool saved_subscribed;
byte saved_known;
byte saved_retained;
byte saved_message_in[SLOTS];
mtype saved_slot_is[SLOTS] = FREE;

ltl latest         { <>[] (newest >= newest_due) }
ltl loss_free      { <>[] ((due & ~got) == 0) }
ltl duplicate_free { [] (twice == 0) }
ltl ordered        { [] (!overtaken) }
ltl late_join      { <>[] (newest >= had_to_get) }
ltl offline        { <>[] ((passed_on_while_away & ~got) == 0) }
ltl max_age        { [] (!too_old) }
ltl max_gap        { [] (!gap_too_long) }
ltl liveness       { [] (publisher_lost -> <> (loss_noticed_after <= LIVENESS)) }

/* Sessions */

inline end_publisher_session() {
  publisher_session = false;
  known = 0
}

inline empty_queue() {
  for (slot : 0 .. SLOTS - 1) {
    message_in[slot] = 0;
    slot_is[slot] = FREE
  }
  slot = 0;
  waiting = 0;
  on_their_way = 0
}

inline end_subscriber_session() {
  if
  :: waiting + on_their_way > 0 -> printf("@ broker ends_session %d\n", waiting + on_their_way)
  :: else
  fi;
  subscriber_session = false;
  subscribed = false;
  empty_queue()
}

/* A connection breaks: what is on the wire is lost, and each side keeps what is not acknowledged. */

inline break_publisher() {
  do
  :: nempty(up) -> up ? kind, number;
     if :: kind == PUBLISH -> printf("@ link loses %d\n", number) :: else fi
  :: empty(up) && nempty(up_answers) -> up_answers ? kind, number; printf("@ link loses_answer %d\n", number)
  :: empty(up) && empty(up_answers) -> break
  od;
  publisher_link = false;
  if :: PUBLISHER_SESSION_LASTS == 0 -> end_publisher_session() :: else fi;
  number = 0
}

inline break_subscriber() {
  do
  :: nempty(down) -> down ? kind, slot, number;
     if :: kind == PUBLISH -> printf("@ link loses %d\n", number) :: else fi
  :: empty(down) && nempty(down_answers) -> down_answers ? kind, slot; printf("@ link loses_answer %d\n", message_in[slot])
  :: empty(down) && empty(down_answers) -> break
  od;
  subscriber_link = false;
  for (slot : 0 .. SLOTS - 1) {
    if
    :: slot_is[slot] == SENT -> slot_is[slot] = WAITS; on_their_way--; waiting++
    :: slot_is[slot] == WAITS && DELIVERED_QOS == 0 && !QUEUES_QOS0 -> free(slot); waiting--
    :: else
    fi
  }
  if :: SUBSCRIBER_SESSION_LASTS == 0 -> end_subscriber_session() :: else fi;
  number = 0;
  slot = 0
}

inline free(which) {
  message_in[which] = 0;
  slot_is[which] = FREE
}

/* The fault has lasted for LASTS: sessions of absent clients end, and messages expire. */

inline time_passes(nothing_is_published) {
  if :: !publisher_link && LASTS > PUBLISHER_SESSION_LASTS -> end_publisher_session() :: else fi;
  if :: !subscriber_link && LASTS > SUBSCRIBER_SESSION_LASTS -> end_subscriber_session() :: else fi;
  for (slot : 0 .. SLOTS - 1) {
    if
    :: slot_is[slot] == WAITS && LASTS > EXPIRES_AFTER ->
       printf("@ broker expires %d\n", message_in[slot]);
       free(slot);
       waiting--
    :: slot_is[slot] == WAITS && LASTS <= EXPIRES_AFTER -> old = old | BIT(message_in[slot])
    :: else
    fi
  }
  slot = 0;
  if
  :: AGES && retained && LASTS <= EXPIRES_AFTER -> old = old | BIT(retained)
  :: !AGES -> old = 0
  :: else
  fi;
  if
  :: nothing_is_published && LASTS > EXPIRES_AFTER && retained -> printf("@ broker expires %d\n", retained); retained = 0
  :: else
  fi
}

/* The broker passes a message on. */

inline enqueue(n) {
  if
  :: !subscriber_link && DELIVERED_QOS == 0 && !QUEUES_QOS0 -> printf("@ broker drops %d\n", n)
  :: IS_KEPT && IS_FULL -> printf("@ broker has_no_room %d\n", n)
  :: IS_KEPT && !IS_FULL ->
     assert(next_slot < SLOTS);
     message_in[next_slot] = n;
     slot_is[next_slot] = WAITS;
     next_slot++;
     waiting++
  fi
}

inline pass_on(n) {
  if :: ABSENT && joined && !subscriber_runs -> passed_on_while_away = passed_on_while_away | BIT(n) :: else fi;
  if :: n > taken -> taken = n :: else fi;
  if :: RETAIN -> retained = n :: else fi;
  if
  :: !subscribed -> printf("@ broker has_no_subscription %d\n", n)
  :: subscribed && SHARED -> printf("@ broker sends_to_other_member %d\n", n)
  :: subscribed && DELIVERED_QOS == 0 -> printf("@ broker drops %d\n", n)  /* at most once */
  :: subscribed -> enqueue(n)
  :: subscribed && OVERLAPPING -> enqueue(n); enqueue(n)
  fi
}

/* The program publishes, the client sends. */

inline publish() {
  published++;
  if :: joined -> due = due | BIT(published); newest_due = published :: else fi
}

inline send(what, n) {
  if
  :: publisher_link -> up ! what, n
  :: else -> printf("@ link loses %d\n", n)  /* the client has not noticed that its connection is gone */
  fi
}

inline connect_publisher() {
  publisher_up = true;
  publisher_link = true;
  if
  :: publisher_session && !PUBLISHER_CLEAN -> printf("@ publisher resumes_session\n"); again = 0
  :: !(publisher_session && !PUBLISHER_CLEAN) ->
     printf("@ publisher begins_session\n");
     known = 0;
     if :: again = 1 :: again = 2 fi  /* a library forgets what is not acknowledged, or publishes it anew */
  fi;
  publisher_session = true;
  for (number : 1 .. 3) {
    if
    :: again == 0 && publisher_has[number] == SENT -> printf("@ publisher sends_again %d\n", number); up ! PUBLISH, number
    :: again == 0 && publisher_has[number] == RECEIVED -> up ! PUBREL, number
    :: again == 1 && (publisher_has[number] == SENT || publisher_has[number] == RECEIVED) ->
       printf("@ publisher forgets %d\n", number);
       publisher_has[number] = FREE
    :: again == 2 && (publisher_has[number] == SENT || publisher_has[number] == RECEIVED) ->
       printf("@ publisher sends_anew %d\n", number);
       publisher_has[number] = WAITS
    :: else
    fi
  }
  number = 0;
  again = 0
}

active proctype Publisher() {
  byte number;
  byte again;
end:
  do
  :: atomic { publisher_runs && published < ALL && PUBLISHED_QOS == 0 ->
       publish();
       if
       :: publisher_up -> printf("@ publisher sends %d\n", published);
          if
          :: send(PUBLISH, published)
          :: publisher_link -> printf("@ link loses %d\n", published)  /* at most once */
          fi
       :: !publisher_up -> printf("@ publisher is_not_connected %d\n", published)
       fi }
  :: atomic { publisher_runs && published < ALL && PUBLISHED_QOS > 0 -> publish(); publisher_has[published] = WAITS }
  :: atomic { CAN_SEND ->
       number = NEXT;
       printf("@ publisher sends %d\n", number);
       publisher_has[number] = SENT;
       send(PUBLISH, number);
       number = 0 }
  :: atomic { publisher_up && up_answers ? [PUBACK, _] ->
       up_answers ? PUBACK, number; publisher_has[number] = FREE; number = 0 }
  :: atomic { publisher_up && up_answers ? [PUBREC, _] ->
       up_answers ? PUBREC, number; publisher_has[number] = RECEIVED; send(PUBREL, number); number = 0 }
  :: atomic { publisher_up && up_answers ? [PUBCOMP, _] ->
       up_answers ? PUBCOMP, number; publisher_has[number] = FREE; number = 0 }
  :: atomic { PUBLISHER_IN_3_1_1 && PUBLISHED_QOS == 1 && !sent_again && publisher_up && publisher_link && HAS(1, SENT) ->
       sent_again = true;  /* 3.1.1 does not forbid it, 5.0 does */
       printf("@ publisher sends_again 1\n");
       up ! PUBLISH, 1 }
  :: atomic { publisher_up && !publisher_link -> publisher_up = false; printf("@ publisher notices_break\n") }
  :: atomic { publisher_runs && !publisher_up && broker_runs && link_works -> connect_publisher() }
  od
}

active proctype Broker() {
  byte number;
  byte slot;
  if :: passes_on_late = false :: PUBLISHED_QOS == 2 -> passes_on_late = true fi;
end:
  do
  :: atomic { broker_runs && up ? [PUBLISH, _] ->
       up ? PUBLISH, number;
       if
       :: PUBLISHED_QOS == 0 -> pass_on(number)
       :: PUBLISHED_QOS == 1 -> pass_on(number); up_answers ! PUBACK, number
       :: PUBLISHED_QOS == 2 ->
          if
          :: !(known & BIT(number)) && !passes_on_late -> pass_on(number)
          :: else
          fi;
          known = known | BIT(number);
          up_answers ! PUBREC, number
       fi;
       number = 0 }
  :: atomic { broker_runs && up ? [PUBREL, _] ->
       up ? PUBREL, number;
       if :: (known & BIT(number)) && passes_on_late -> pass_on(number) :: else fi;
       known = known & ~BIT(number);
       up_answers ! PUBCOMP, number;
       number = 0 }
  :: atomic { broker_runs && subscriber_link && waiting > 0 && on_their_way < WINDOW ->
       do :: slot_is[slot] == WAITS -> break :: else -> slot++ od;
       printf("@ broker sends %d\n", message_in[slot]);
       down ! PUBLISH, slot, message_in[slot];
       waiting--;
       if
       :: DELIVERED_QOS == 0 -> free(slot)
       :: else -> slot_is[slot] = SENT; on_their_way++
       fi;
       slot = 0 }
  :: atomic { broker_runs && down_answers ? [PUBACK, _] ->
       down_answers ? PUBACK, slot; free(slot); on_their_way--; slot = 0 }
  :: atomic { broker_runs && down_answers ? [PUBREC, _] ->
       down_answers ? PUBREC, slot; slot_is[slot] = RECEIVED; down ! PUBREL, slot, message_in[slot]; slot = 0 }
  :: atomic { broker_runs && down_answers ? [PUBCOMP, _] ->
       down_answers ? PUBCOMP, slot; free(slot); on_their_way--; slot = 0 }
  :: atomic { broker_runs && retained && PERIOD > EXPIRES_AFTER ->
       printf("@ broker expires %d\n", retained); retained = 0 }
  od
}

inline deliver(n) {
  printf("@ subscriber gets %d\n", n);
  if :: got & BIT(n) -> twice = twice | BIT(n) :: else fi;
  got = got | BIT(n);
  if :: old & BIT(n) -> too_old = true :: else fi;
  if
  :: n > 1 && (due & BIT(n - 1)) && ((got & BIT(n - 1)) -> PERIOD : 2 * PERIOD) > MAX_GAP -> gap_too_long = true
  :: else
  fi;
  if :: n < newest -> overtaken = true :: else -> newest = n fi
}

inline connect_subscriber() {
  subscriber_link = true;
  if
  :: subscriber_session && !SUBSCRIBER_CLEAN ->
     printf("@ subscriber resumes_session\n");
     for (slot : 0 .. SLOTS - 1) {
       if :: slot_is[slot] == RECEIVED -> down ! PUBREL, slot, message_in[slot] :: else fi
     }
     slot = 0;
     if :: subscribes = true :: !must_subscribe && subscribed -> subscribes = false fi
  :: else ->
     end_subscriber_session();
     printf("@ subscriber begins_session\n");
     seen = 0;
     subscribes = true
  fi;
  subscriber_session = true
}

inline subscribe() {
  if
  :: retained && !SHARED && (RETAIN_HANDLING == SEND || (RETAIN_HANDLING == SEND_IF_NEW && !subscribed)) -> enqueue(retained)
  :: else
  fi;
  printf("@ subscriber subscribes\n");
  if :: must_subscribe -> had_to_get = taken :: else fi;
  subscribed = true;
  joined = true;
  must_subscribe = false;
  subscribes = false
}

active proctype Subscriber() {
  byte number;
  byte slot;
  bool subscribes;
end:
  do
  :: atomic { !slow && down ? [PUBLISH, _, _] ->
       down ? PUBLISH, slot, number;
       if
       :: DELIVERED_QOS == 0 -> deliver(number)
       :: DELIVERED_QOS == 1 -> deliver(number); down_answers ! PUBACK, slot
       :: DELIVERED_QOS == 2 ->
          if :: !(seen & BIT(slot)) -> deliver(number) :: else fi;
          seen = seen | BIT(slot);
          down_answers ! PUBREC, slot
       fi;
       number = 0;
       slot = 0 }
  :: atomic { !slow && down ? [PUBREL, _, _] ->
       down ? PUBREL, slot, _; seen = seen & ~BIT(slot); down_answers ! PUBCOMP, slot; slot = 0 }
  :: atomic { down ? [WILL, _, _] ->
       down ? WILL, slot, _; slot = 0; printf("@ subscriber gets_will\n"); loss_noticed_after = WILL_COMES_AFTER }
  :: atomic { subscriber_runs && !subscriber_link && broker_runs && link_works -> connect_subscriber() }
  :: atomic { subscriber_link && subscribes -> subscribe() }
  od
}

/* What a broker has after a crash: all, where it saves each message at once; else what it saved at some moment before. */

inline save() {
  saved = true;
  saved_publisher_session = publisher_session;
  saved_known = known;
  saved_subscriber_session = subscriber_session;
  saved_subscribed = subscribed;
  saved_retained = retained;
  for (slot : 0 .. SLOTS - 1) {
    saved_message_in[slot] = message_in[slot];
    saved_slot_is[slot] = slot_is[slot]
  }
  slot = 0
}

inline forget() {
  end_publisher_session();
  end_subscriber_session();
  retained = 0
}

inline restore() {
  publisher_session = saved_publisher_session && PUBLISHER_SESSION_LASTS > 0;
  known = saved_known;
  retained = saved_retained;
  if
  :: SUBSCRIBER_SESSION_LASTS > 0 ->
     subscriber_session = saved_subscriber_session;
     subscribed = saved_subscribed;
     empty_queue();
     for (slot : 0 .. SLOTS - 1) {
       message_in[slot] = saved_message_in[slot];
       slot_is[slot] = saved_slot_is[slot];
       if
       :: slot_is[slot] == SENT -> slot_is[slot] = WAITS; waiting++
       :: slot_is[slot] == WAITS -> waiting++
       :: slot_is[slot] == RECEIVED -> on_their_way++
       :: else
       fi
     }
     slot = 0
  :: else
  fi
}

inline kill_subscriber() {
  subscriber_runs = false;
  break_subscriber();
  must_subscribe = true;
  newest = 0;
  had_to_get = 0;
  if :: SUBSCRIBER_STORES -> skip :: else -> seen = 0 fi
}

inline start_subscriber() {
  time_passes(AGES || PERIOD > EXPIRES_AFTER);
  if :: SUBSCRIBER_NEW_ID && must_subscribe -> end_subscriber_session() :: else fi;
  printf("@ subscriber started\n");
  subscriber_runs = true
}

inline kill_publisher() {
  publisher_runs = false;
  publisher_up = false;
  break_publisher();
  for (number : 1 .. 3) {
    if
    :: publisher_has[number] != FREE && !PUBLISHER_STORES -> printf("@ publisher forgets %d\n", number); publisher_has[number] = FREE
    :: else
    fi
  }
  number = 0
}

inline start_publisher() {
  time_passes(true);
  if :: PUBLISHER_NEW_ID -> end_publisher_session() :: else fi;
  printf("@ publisher started\n");
  publisher_runs = true
}

inline end_broker() {
  broker_runs = false;
  break_publisher();
  break_subscriber();
  if
  :: BROKER_SAVES == NEVER -> forget()
  :: FAULT == BROKER_CRASH && BROKER_SAVES == NOW_AND_THEN && saved -> restore()
  :: FAULT == BROKER_CRASH && BROKER_SAVES == NOW_AND_THEN && !saved -> forget()
  :: else
  fi
}

/* The publisher is lost for good, and no packet says so: the broker notices by its keep alive only. */

inline lose_publisher() {
  printf("@ publisher lost\n");
  publisher_runs = false;
  publisher_up = false;
  publisher_lost = true
}

inline send_will() {
  printf("@ broker notices_loss\n");
  break_publisher();
  if
  :: HAS_WILL && subscriber_link -> printf("@ broker sends_will\n"); down ! WILL, 0, 0
  :: else -> printf("@ broker has_no_will\n")
  fi
}

active proctype Fault() {
  byte number;
  byte slot;
  mtype kind;
  if
  :: ABSENT && FAULT != SUBSCRIBER_RESTART -> atomic { joined -> printf("@ subscriber leaves\n"); subscriber_runs = false; break_subscriber() }
  :: else
  fi;
  if
  :: FAULT == CONNECTED && !AGES
  :: FAULT == CONNECTED && AGES -> atomic { printf("@ broker keeps_what_waits\n"); time_passes(true) }
  :: FAULT == SLOW_READER -> atomic { printf("@ subscriber takes_again\n"); time_passes(PERIOD > EXPIRES_AFTER); slow = false }
  :: FAULT == LINK_OUTAGE ->
     atomic { joined -> printf("@ link cut\n"); link_works = false; break_publisher(); break_subscriber() };
     atomic { printf("@ link restored\n"); time_passes(true); link_works = true }
  :: FAULT == SUBSCRIBER_RESTART ->
     atomic { joined -> printf("@ subscriber killed\n"); kill_subscriber() };
     atomic { start_subscriber() }
  :: FAULT == PUBLISHER_RESTART ->
     atomic { printf("@ publisher killed\n"); kill_publisher() };
     atomic { start_publisher() }
  :: FAULT == PUBLISHER_LOST ->
     atomic { publisher_link && publisher_up && subscriber_link && joined -> lose_publisher() };
     atomic { KEEPS_ALIVE -> send_will() }
  :: FAULT == BROKER_STOP ->
     atomic { printf("@ broker stopped\n"); end_broker() };
     atomic { printf("@ broker started\n"); broker_runs = true }
  :: FAULT == BROKER_CRASH ->
     if
     :: true
     :: BROKER_SAVES == NOW_AND_THEN -> atomic { printf("@ broker saves\n"); save() }
     fi;
     atomic { printf("@ broker killed\n"); end_broker() };
     atomic { printf("@ broker started\n"); broker_runs = true }
  fi;
  if
  :: ABSENT && FAULT != SUBSCRIBER_RESTART -> atomic { start_subscriber() }
  :: else
  fi
}
