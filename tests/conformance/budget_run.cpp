// One end of a run on Fast DDS that measures budgets, as budget_run.py is one on Cyclone DDS: it reads, or writes and
// prints what the loopback interface carried, in bytes by sample. Arguments: read|write KIND SIZE COUNT.

#include <chrono>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fast_dds.hpp"

using Clock = std::chrono::steady_clock;

static const auto PERIOD = std::chrono::milliseconds(20);
static const auto PATIENCE = std::chrono::seconds(20);

struct Bytes
{
    std::vector<unsigned char> data;
};

// A sample of any size; a length of four bytes is a part of it.
class BytesType : public DataType<Bytes>
{
public:

    explicit BytesType(uint32_t size)
        : DataType("Blob", size + 4, false)
        , size_(size)
    {
    }

protected:

    void write(const Bytes&, rtps::SerializedPayload_t& payload) override
    {
        const unsigned char encapsulation[4] = {0, 1, 0, 0};  // CDR, little endian
        std::memset(payload.data, 1, size_ + 4);
        std::memcpy(payload.data, encapsulation, 4);
        payload.encapsulation = CDR_LE;
        payload.length = size_ + 4;
    }

    bool read(const rtps::SerializedPayload_t&, Bytes&) override
    {
        return true;
    }

private:

    uint32_t size_;
};

static long long carried()
{
    std::ifstream file("/proc/net/dev");
    for (std::string line; std::getline(file, line);)
    {
        const size_t at = line.find("lo:");
        if (at != std::string::npos)
        {
            return std::stoll(line.substr(at + 3));
        }
    }
    return 0;
}

static DomainParticipant* join()
{
    DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(std::make_shared<rtps::UDPv4TransportDescriptor>());
    auto& builtin = qos.wire_protocol().builtin;
    // Discovery is quiet while samples are sent.
    builtin.discovery_config.leaseDuration = Duration_t(2000, 0);
    builtin.discovery_config.leaseDuration_announcementperiod = Duration_t(1000, 0);
    for (uint32_t index = 0; index < 2; ++index)
    {
        rtps::Locator_t peer;
        rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
        peer.port = 7410 + 2 * index;
        builtin.initialPeersList.push_back(peer);
    }
    return DomainParticipantFactory::get_instance()->create_participant(0, qos);
}

template<typename Qos>
static void common(Qos& qos, bool reliable)
{
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 1;
    qos.data_sharing().off();
}

static int read(DomainParticipant* participant, Topic* topic, bool reliable)
{
    DataReaderQos qos;
    common(qos, reliable);
    DataReader* reader = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos);
    const auto ends = Clock::now() + 3 * PATIENCE;
    bool met = false;
    Bytes sample;
    SampleInfo info;
    while (Clock::now() < ends)
    {
        SubscriptionMatchedStatus matched;
        reader->get_subscription_matched_status(matched);
        if (met && matched.current_count == 0)
        {
            break;
        }
        met = met || matched.current_count > 0;
        while (reader->take_next_sample(&sample, &info) == RETCODE_OK)
        {
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    std::_Exit(met ? 0 : 1);
}

static int write(DomainParticipant* participant, Topic* topic, bool reliable, int count)
{
    DataWriterQos qos;
    common(qos, reliable);
    DataWriter* writer = participant->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
    PublicationMatchedStatus matched;
    const auto ends = Clock::now() + PATIENCE;
    while (Clock::now() < ends && matched.current_count == 0)
    {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        writer->get_publication_matched_status(matched);
    }
    if (matched.current_count == 0)
    {
        std::cerr << "no reader" << std::endl;
        return 1;
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));  // until discovery is quiet
    Bytes sample;
    sent(writer, &sample);
    const long long before = carried();
    for (int number = 0; number < count; ++number)
    {
        sent(writer, &sample);
        std::this_thread::sleep_for(PERIOD);
    }
    std::cout << static_cast<double>(carried() - before) / count << " 0" << std::endl;
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
    std::_Exit(0);
}

int main(int, char** arguments)
{
    const bool reliable = std::string(arguments[2]) == "reliable";
    const int size = std::stoi(arguments[3]);
    DomainParticipant* participant = join();
    TypeSupport type(new BytesType(static_cast<uint32_t>(size)));
    type.register_type(participant);
    Topic* topic = participant->create_topic("budget", "Blob", TOPIC_QOS_DEFAULT);
    return std::string(arguments[1]) == "read" ? read(participant, topic, reliable)
                                               : write(participant, topic, reliable, std::stoi(arguments[4]));
}
