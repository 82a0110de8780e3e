// One end of a pair on Fast DDS: it reads settings and commands as cqos_live/dds/prove/stage.py writes them.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "fast_dds.hpp"

using Clock = std::chrono::steady_clock;

static const long long INFINITE = 0x7fffffffffffffffLL;  // nanoseconds
static const auto PAUSE = std::chrono::milliseconds(4);   // between two looks at what happened

static const std::map<int, std::string> NAMES = {
    {1, "user_data"}, {2, "durability"}, {3, "presentation"}, {4, "deadline"}, {5, "latency_budget"}, {6, "ownership"},
    {8, "liveliness"}, {10, "partition"}, {11, "reliability"}, {12, "destination_order"}, {23, "data_representation"},
    {24, "type_consistency"}, {25, "disable_positive_acks"}};

static void say(const std::string& what, const std::string& number = "-", const std::string& text = "")
{
    std::cout << what << ' ' << number << (text.empty() ? "" : " ") << text << std::endl;
}

// --- settings

static std::map<std::string, std::string> settings;

static std::string decoded(const std::string& text)
{
    std::string found;
    for (size_t at = 0; at < text.size(); ++at)
    {
        if (text[at] == '%' && at + 2 < text.size())
        {
            found += static_cast<char>(std::stoi(text.substr(at + 1, 2), nullptr, 16));
            at += 2;
        }
        else
        {
            found += text[at];
        }
    }
    return found;
}

static std::vector<std::string> list(const std::string& name)
{
    std::vector<std::string> found;
    std::stringstream parts(settings[name]);
    for (std::string part; std::getline(parts, part, ',');)
    {
        found.push_back(part == "%" ? "" : decoded(part));
    }
    return found;
}

static bool has(const std::string& name)
{
    return settings.count(name) > 0;
}

static bool is(const std::string& name, const std::string& value)
{
    return has(name) && settings[name] == value;
}

static long long number(const std::string& name, long long otherwise)
{
    return has(name) ? std::stoll(settings[name]) : otherwise;
}

static Duration_t seconds(long long nanoseconds)
{
    if (nanoseconds == INFINITE)
    {
        return c_TimeInfinite;
    }
    return Duration_t(static_cast<int32_t>(nanoseconds / 1000000000), static_cast<uint32_t>(nanoseconds % 1000000000));
}

static Duration_t duration(const std::string& name)
{
    return seconds(std::stoll(settings[name]));
}

static int length(const std::string& name, int otherwise)
{
    return static_cast<int>(number(name, otherwise));
}

// --- the data type: an instance where there are keys, and the number of the sample

struct Sample
{
    int32_t instance = 0;
    int32_t value = 0;
};

class SampleType : public DataType<Sample>
{
public:

    SampleType(const std::string& name, bool keyed)
        : DataType(name, 4 + (keyed ? 8 : 4), keyed)
        , keyed_(keyed)
    {
    }

protected:

    void write(const Sample& sample, rtps::SerializedPayload_t& payload) override
    {
        const unsigned char encapsulation[4] = {0, 1, 0, 0};  // CDR, little endian
        std::memcpy(payload.data, encapsulation, 4);
        payload.encapsulation = CDR_LE;
        payload.length = 4;
        if (keyed_)
        {
            append(payload, sample.instance);
        }
        append(payload, sample.value);
    }

    bool read(const rtps::SerializedPayload_t& payload, Sample& sample) override
    {
        const bool little = payload.length > 1 && (payload.data[1] & 1) != 0;
        uint32_t at = 4;
        if (keyed_)
        {
            sample.instance = number_at(payload, at, little);
            at += 4;
        }
        if (payload.length < at + 4)
        {
            return keyed_ && payload.length >= at;  // only the key: the instance was disposed
        }
        sample.value = number_at(payload, at, little);
        return true;
    }

    bool find_key(const Sample& sample, rtps::InstanceHandle_t& handle) override
    {
        if (!keyed_)
        {
            return false;
        }
        const uint32_t instance = static_cast<uint32_t>(sample.instance);
        for (int at = 0; at < 16; ++at)
        {
            handle.value[at] = at < 4 ? static_cast<unsigned char>(instance >> (24 - 8 * at)) : 0;
        }
        return true;
    }

private:

    static void append(rtps::SerializedPayload_t& payload, int32_t value)
    {
        for (int at = 0; at < 4; ++at)
        {
            payload.data[payload.length++] = static_cast<unsigned char>(static_cast<uint32_t>(value) >> (8 * at));
        }
    }

    static int32_t number_at(const rtps::SerializedPayload_t& payload, uint32_t from, bool little)
    {
        uint32_t value = 0;
        for (uint32_t at = 0; at < 4 && from + at < payload.length; ++at)
        {
            value |= static_cast<uint32_t>(payload.data[from + at]) << (little ? 8 * at : 24 - 8 * at);
        }
        return static_cast<int32_t>(value);
    }

    bool keyed_;
};

// --- QoS

static DurabilityQosPolicyKind durability()
{
    const std::string& kind = settings["durability"];
    return kind == "transient_local" ? TRANSIENT_LOCAL_DURABILITY_QOS
           : kind == "transient" ? TRANSIENT_DURABILITY_QOS
           : kind == "persistent" ? PERSISTENT_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
}

static HistoryQosPolicyKind history(const std::string& name)
{
    return is(name, "keep_all") ? KEEP_ALL_HISTORY_QOS : KEEP_LAST_HISTORY_QOS;
}

static void limit(ResourceLimitsQosPolicy& limits)
{
    limits.max_samples = length("resource_limits.max_samples", limits.max_samples);
    limits.max_instances = length("resource_limits.max_instances", limits.max_instances);
    limits.max_samples_per_instance =
        length("resource_limits.max_samples_per_instance", limits.max_samples_per_instance);
    if (limits.max_samples > 0 && limits.allocated_samples > limits.max_samples)
    {
        limits.allocated_samples = limits.max_samples;
    }
}

// What both ends have.
template<typename Qos>
static void common(Qos& qos)
{
    if (has("reliability"))
    {
        qos.reliability().kind = is("reliability", "reliable") ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    }
    if (has("reliability.max_blocking_time"))
    {
        qos.reliability().max_blocking_time = duration("reliability.max_blocking_time");
    }
    if (has("durability"))
    {
        qos.durability().kind = durability();
    }
    if (has("deadline"))
    {
        qos.deadline().period = duration("deadline");
    }
    if (has("latency_budget"))
    {
        qos.latency_budget().duration = duration("latency_budget");
    }
    if (has("liveliness"))
    {
        qos.liveliness().kind = is("liveliness", "manual_by_participant") ? MANUAL_BY_PARTICIPANT_LIVELINESS_QOS
                                : is("liveliness", "manual_by_topic") ? MANUAL_BY_TOPIC_LIVELINESS_QOS
                                : AUTOMATIC_LIVELINESS_QOS;
    }
    if (has("liveliness.lease_duration"))
    {
        qos.liveliness().lease_duration = duration("liveliness.lease_duration");
    }
    if (has("liveliness.announcement_period"))
    {
        const long long lease = number("liveliness.lease_duration", INFINITE);
        qos.liveliness().announcement_period = number("liveliness.announcement_period", 0) != 0
                                               ? duration("liveliness.announcement_period")
                                               : seconds(lease == INFINITE ? lease : lease / 3 * 2);
    }
    if (has("ownership"))
    {
        qos.ownership().kind = is("ownership", "exclusive") ? EXCLUSIVE_OWNERSHIP_QOS : SHARED_OWNERSHIP_QOS;
    }
    if (has("destination_order"))
    {
        qos.destination_order().kind = is("destination_order", "by_source_timestamp")
                                       ? BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS
                                       : BY_RECEPTION_TIMESTAMP_DESTINATIONORDER_QOS;
    }
    if (has("history"))
    {
        qos.history().kind = history("history");
    }
    qos.history().depth = length("history.depth", qos.history().depth);
    limit(qos.resource_limits());
    qos.data_sharing().off();  // what is shared in memory cannot be cut
}

static std::vector<DataRepresentationId_t> representations()
{
    std::vector<DataRepresentationId_t> found;
    for (const std::string& name : list("data_representation"))
    {
        found.push_back(name == "xml" ? XML_DATA_REPRESENTATION
                        : name == "xcdr2" ? XCDR2_DATA_REPRESENTATION : XCDR_DATA_REPRESENTATION);
    }
    return found;
}

template<typename Qos>
static void group(Qos& qos)
{
    for (const std::string& name : list("partition"))
    {
        qos.partition().push_back(name.c_str());
    }
    PresentationQosPolicy& presentation = qos.presentation();
    if (has("presentation.access_scope"))
    {
        presentation.access_scope = is("presentation.access_scope", "group") ? GROUP_PRESENTATION_QOS
                                    : is("presentation.access_scope", "topic") ? TOPIC_PRESENTATION_QOS
                                    : INSTANCE_PRESENTATION_QOS;
    }
    presentation.coherent_access = number("presentation.coherent_access", presentation.coherent_access) != 0;
    presentation.ordered_access = number("presentation.ordered_access", presentation.ordered_access) != 0;
}

// --- why something is not created

class Complaints : public LogConsumer
{
public:

    static std::string& last()
    {
        static std::string text;
        return text;
    }

    void Consume(const Log::Entry& entry) override
    {
        if (entry.kind == Log::Kind::Error)
        {
            last() = entry.message;
        }
    }
};

static std::string complaint()
{
    Log::Flush();
    std::string text = Complaints::last();
    for (char& each : text)
    {
        each = each == '\n' ? ' ' : each;
    }
    return text;
}

// --- the end

static std::atomic<bool> cut{false};
static std::atomic<bool> other_end_seen{false};
static bool announced = false;
static bool connected = false;
static std::set<int> named;

// Notices that the other end is there, whether the two match or not.
class Discovery : public DiscoveryListener
{
protected:

    void discovered(const std::string& topic) override
    {
        if (topic == decoded(settings["topic"]))
        {
            other_end_seen = true;
        }
    }
};

static void watch(bool matched, const IncompatibleQosStatus& incompatible)
{
    if (other_end_seen && !announced)
    {
        announced = true;
        say("seen");
    }
    if (matched != connected)
    {
        connected = matched;
        say(matched ? "matched" : "unmatched");
    }
    for (const QosPolicyCount& each : incompatible.policies)
    {
        const int id = static_cast<int>(each.policy_id);
        if (each.count > 0 && id > 0 && named.insert(id).second)
        {
            say("incompatible", "-", NAMES.count(id) ? NAMES.at(id) : std::to_string(id));
        }
    }
}

static void count(const std::string& what, int change)
{
    if (change > 0)
    {
        say(what, "-", std::to_string(change));
    }
}

static DomainParticipant* join()
{
    const int domain = length("domain", 0);
    DomainParticipantQos qos;
    auto transport = std::make_shared<rtps::test_UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.emplace_back("127.0.0.1");
    transport->messages_filter_ = [](rtps::CDRMessage_t&) { return cut.load(); };
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    auto& builtin = qos.wire_protocol().builtin;
    rtps::Locator_t own;
    rtps::IPLocator::setIPv4(own, 127, 0, 0, 1);
    own.port = 0;
    builtin.metatrafficUnicastLocatorList.push_back(own);
    for (int index = 0; index < 8; ++index)
    {
        rtps::Locator_t peer = own;
        peer.port = static_cast<uint32_t>(7400 + 250 * domain + 10 + 2 * index);
        builtin.initialPeersList.push_back(peer);
    }
    // A program that starts again is found within half a second, rather than within three.
    builtin.discovery_config.leaseDuration_announcementperiod = Duration_t(0, 500000000);
    if (has("lease"))
    {
        const long long third = std::min(number("lease", 0) / 3, 500000000LL);
        builtin.discovery_config.leaseDuration = duration("lease");
        builtin.discovery_config.leaseDuration_announcementperiod = seconds(third);
    }
    static Discovery discovery;
    return DomainParticipantFactory::get_instance()->create_participant(
        static_cast<uint32_t>(domain), qos, &discovery, StatusMask::none());
}

class End
{
public:

    virtual ~End() = default;
    virtual void look() = 0;

    virtual void send(int, int, double)
    {
    }
};

class Writing : public End
{
public:

    bool create(DomainParticipant* participant, Topic* topic)
    {
        PublisherQos outer;
        group(outer);
        DataWriterQos qos;
        common(qos);
        qos.representation().m_value = representations();
        qos.reliable_writer_qos().disable_positive_acks.enabled = number("disable_positive_acks", 0) != 0;
        if (has("lifespan"))
        {
            qos.lifespan().duration = duration("lifespan");
        }
        qos.ownership_strength().value = static_cast<uint32_t>(number("ownership_strength", 0));
        qos.writer_data_lifecycle().autodispose_unregistered_instances = number("writer_data_lifecycle", 1) != 0;
        auto& service = qos.durability_service();
        service.history_kind = history("durability_service.history_kind");
        service.history_depth = length("durability_service.history_depth", 1);
        Publisher* publisher = participant->create_publisher(outer);
        writer_ = publisher == nullptr ? nullptr : publisher->create_datawriter(topic, qos);
        return writer_ != nullptr;
    }

    void look() override
    {
        PublicationMatchedStatus matched;
        writer_->get_publication_matched_status(matched);
        OfferedIncompatibleQosStatus incompatible;
        writer_->get_offered_incompatible_qos_status(incompatible);
        watch(matched.current_count > 0, incompatible);
        LivelinessLostStatus lost;
        writer_->get_liveliness_lost_status(lost);
        count("liveliness_lost", lost.total_count_change);
        OfferedDeadlineMissedStatus missed;
        writer_->get_offered_deadline_missed_status(missed);
        count("deadline_missed", static_cast<int>(missed.total_count_change));
    }

    void send(int first, int last, double milliseconds) override
    {
        const int instances = length("instances", 1);
        auto due = Clock::now();
        for (int value = first; value <= last; ++value)
        {
            while (Clock::now() < due)
            {
                std::this_thread::sleep_for(std::min<Clock::duration>(due - Clock::now(), PAUSE));
                look();
            }
            due += std::chrono::microseconds(static_cast<long long>(milliseconds * 1000));
            Sample sample;
            sample.instance = value % instances;
            sample.value = value;
            const bool taken = sent(writer_, &sample);
            say(taken ? "sent" : "unsent", std::to_string(value), taken ? "" : "timeout");
        }
        say("done");
    }

private:

    DataWriter* writer_ = nullptr;
};

class Reading : public End
{
public:

    bool create(DomainParticipant* participant, Topic* topic)
    {
        SubscriberQos outer;
        group(outer);
        DataReaderQos qos;
        common(qos);
        accept(qos, representations());
        if (number("disable_positive_acks", 0) != 0)
        {
            acknowledge_nothing(qos);
        }
        if (has("time_based_filter"))
        {
            qos.time_based_filter().minimum_separation = duration("time_based_filter");
        }
        Subscriber* subscriber = participant->create_subscriber(outer);
        reader_ = subscriber == nullptr ? nullptr : subscriber->create_datareader(topic, qos);
        pause_ = std::chrono::nanoseconds(number("taken_every", 0));
        due_ = Clock::now() + pause_;
        return reader_ != nullptr;
    }

    void look() override
    {
        SubscriptionMatchedStatus matched;
        reader_->get_subscription_matched_status(matched);
        RequestedIncompatibleQosStatus incompatible;
        reader_->get_requested_incompatible_qos_status(incompatible);
        watch(matched.current_count > 0, incompatible);
        SampleLostStatus lost;
        reader_->get_sample_lost_status(lost);
        count("sample_lost", lost.total_count_change);
        SampleRejectedStatus rejected;
        reader_->get_sample_rejected_status(rejected);
        count("sample_rejected", static_cast<int>(rejected.total_count_change));
        RequestedDeadlineMissedStatus missed;
        reader_->get_requested_deadline_missed_status(missed);
        count("deadline_missed", static_cast<int>(missed.total_count_change));
        LivelinessChangedStatus alive;
        reader_->get_liveliness_changed_status(alive);
        if (alive.not_alive_count_change > 0)
        {
            say("not_alive");
        }
        if (Clock::now() < due_)
        {
            return;
        }
        due_ += pause_;
        Sample sample;
        SampleInfo info;
        while (reader_->take_next_sample(&sample, &info) == RETCODE_OK)
        {
            if (info.valid_data)
            {
                say("arrived", std::to_string(sample.value));
            }
        }
    }

private:

    DataReader* reader_ = nullptr;
    Clock::duration pause_{};
    Clock::time_point due_;
};

static int work(End& end)
{
    say("created");
    std::mutex mutex;
    std::condition_variable there;
    std::deque<std::string> lines;
    std::thread([&]()
    {
        for (std::string line; std::getline(std::cin, line);)
        {
            std::lock_guard<std::mutex> guard(mutex);
            lines.push_back(line);
            there.notify_one();
        }
        std::_Exit(0);  // the command has ended, and so does its program
    }).detach();
    for (;;)
    {
        end.look();
        std::string line;
        {
            std::unique_lock<std::mutex> guard(mutex);
            if (!there.wait_for(guard, PAUSE, [&]() { return !lines.empty(); }))
            {
                continue;
            }
            line = lines.front();
            lines.pop_front();
        }
        std::stringstream words(line);
        std::string word;
        words >> word;
        if (word == "send")
        {
            int first = 0;
            int last = 0;
            double milliseconds = 0;
            words >> first >> last >> milliseconds;
            end.send(first, last, milliseconds);
        }
        else
        {
            cut = word == "cut";
        }
    }
}

template<typename Kind>
static int play()
{
    Log::ClearConsumers();
    Log::RegisterConsumer(std::unique_ptr<LogConsumer>(new Complaints()));
    DomainParticipant* participant = join();
    const std::string name = is("type", "") || !has("type") ? "cqos::Sample" : decoded(settings["type"]);
    TypeSupport type(new SampleType(name, number("keyed", 0) != 0));
    Topic* topic = nullptr;
    if (participant != nullptr && type.register_type(participant) == RETCODE_OK)
    {
        topic = participant->create_topic(decoded(settings["topic"]), name, TOPIC_QOS_DEFAULT);
    }
    if (topic == nullptr)
    {
        std::cerr << "Fast DDS creates no participant or topic: " << complaint() << std::endl;
        return 1;
    }
    Kind end;
    if (!end.create(participant, topic))
    {
        say("refused", "-", complaint());
        std::string line;
        while (std::getline(std::cin, line))
        {
        }
        return 0;
    }
    return work(end);
}

int main()
{
    std::string line;
    while (std::getline(std::cin, line) && line != "start")
    {
        std::stringstream words(line);
        std::string set;
        std::string name;
        std::string value;
        words >> set >> name >> value;
        settings[name] = value;
    }
    return settings["role"] == "publisher" ? play<Writing>() : play<Reading>();
}
